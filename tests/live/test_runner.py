from pathlib import Path

import numpy as np
import pytest
from tests.fixtures.live import block, run, until
from tests.fixtures.waiting import until as wait_until

from miburi.bma.settings import Settings
from miburi.errors import BodyError, InputError
from miburi.feelings import FEELINGS, EmotionalModel, Expression, Stimulus
from miburi.ik import Solution
from miburi.live.bodies import KINDS
from miburi.live.commands import WAITING, BusyError
from miburi.live.recording.archive import Archive
from miburi.live.recording.recorder import read
from miburi.live.runner import STEP, Runner
from miburi.live.state import State, StopOut
from miburi.live.wishes import ChangeBody, Feel, MoveHand, Pause, Perform, Release
from miburi.partner import solve_with
from miburi.robot import JOINTS, Array, Robot, forward
from miburi.safety.contact import PAPER_RATIO
from miburi.safety.stop import StopReason
from miburi.serving.press import press


def kinds(runner: Runner) -> list[str]:
    return [event.kind for event in runner.history.after(0) if event.kind != "started"]


def test_a_remark_is_felt_noted_and_shown(runner: Runner) -> None:
    future = runner.ask(Feel(Stimulus("happiness", 0.9, "speech")))
    state = until(runner, lambda state: state.expressed)
    future.result(0)
    assert state.felt is not None
    assert state.expressed is not None
    assert state.expressed.feeling == "happiness"
    assert state.face[FEELINGS.index("happiness")] == pytest.approx(state.expressed.mood, abs=1e-3)
    assert max(state.face) == state.face[FEELINGS.index("happiness")]
    assert kinds(runner) == ["stimulus", "gesture_begun"]
    states = run(runner, 2.0)
    assert max(state.hand_speed for state in states) > 0.05
    assert max(state.extent for state in states) > 0.03
    assert any(ratio is not None for state in states for ratio in state.ratios)


def test_the_same_seed_and_commands_give_the_same_states(robot: Robot, tmp_path: Path) -> None:
    def story(seed: int) -> list[State]:
        feelings = EmotionalModel()
        feelings.set_state(mood={"thrill": 0.6})
        runner = Runner(robot, feelings, Archive(tmp_path), seed=seed, boot="5f2c9a10")
        runner.ask(Feel(Stimulus("thrill", 1.0)))
        return run(runner, 1.0)

    assert (one := story(1)) == story(1)
    assert one != story(2)


@pytest.mark.parametrize("settings", [Settings.paper(), None])
def test_the_inverse_kinematics_can_be_chosen(
    settings: Settings | None, robot: Robot, tmp_path: Path
) -> None:
    """Table 2 as printed leaves the hands where they are only roughly asked to be."""
    goals: list[tuple[float, ...]] = []
    solve = solve_with(settings)

    def noting(robot: Robot, target: Array, start: Array) -> Solution:
        solution = solve(robot, target, start)
        goals.append(tuple(forward(robot, solution.angles) - target))
        return solution

    runner = Runner(robot, EmotionalModel(), Archive(tmp_path), solve=noting)
    runner.ask(Perform(Expression("happiness", 0.9)))
    run(runner, 3.0)
    assert len(goals) >= 3
    worst = float(np.abs(goals).max())
    assert worst > 1e-4 if settings else worst < 1e-5


def test_who_has_been_answered_reads_a_state_that_shows_it(runner: Runner) -> None:
    paused: list[bool] = []
    for wanted in (True, False):
        answered = runner.ask(Pause(wanted))
        answered.add_done_callback(lambda _: paused.append(runner.snapshot.state.paused))
        runner.tick()
    assert paused == [True, False]


def test_a_hand_in_the_way_is_explained(runner: Runner) -> None:
    runner.ask(Feel(Stimulus("happiness", 0.9)))
    state = block(runner)
    stop = state.stop
    assert stop is not None
    assert stop.reason == "contact"
    assert stop.motor in (joint for joint in JOINTS if "right" in joint or joint == "waist")
    assert stop.part is not None
    assert (stop.force or 0) > 0.1
    assert stop.mood_before is not None
    assert stop.mood_after == pytest.approx(0.8 * stop.mood_before, rel=1e-3)
    assert stop.measured is not None
    assert stop.expected is not None
    assert stop.measured < stop.expected
    if stop.sign == "speed":
        assert stop.ratio is not None
        assert stop.ratio < PAPER_RATIO / 10_000
        assert stop.measured / stop.expected == pytest.approx(stop.ratio, abs=0.01)
    assert kinds(runner)[-2:] == ["stop", "gesture_broken_off"]
    assert runner.history.after(0)[-2].stop == stop
    runner.ask(MoveHand(None, np.array([0.0, 0.0, 1.0])))
    assert until(runner, lambda state: state.phase == "returning").stop is None
    assert until(runner, lambda state: state.phase == "idle").hand_out is False


def test_a_stop_that_is_no_contact_has_nothing_of_the_last_one(runner: Runner) -> None:
    runner.recordings.start()
    runner.ask(Feel(Stimulus("happiness", 0.9)))
    block(runner)
    runner.ask(MoveHand(None, np.array([0.0, 0.0, 1.0])))
    until(runner, lambda state: state.stop is None)
    runner.stop()
    runner.tick()
    stop = runner.snapshot.state.stop
    assert stop is not None
    assert stop == StopOut(time=stop.time, reason=StopReason.ASKED)
    runner.recordings.end()
    *_, told = read(runner.recordings.find("miburi-0001.mcap"), ["/contacts"])
    assert told.content.pop("reason") == "asked"
    assert set(told.content.values()) == {None}


def test_a_release_at_once_after_a_contact_invents_no_contacts(runner: Runner) -> None:
    block(runner)
    runner.ask(MoveHand(None, np.array([0.0, 0.0, 1.0])))
    mood = runner.snapshot.state.mood
    for _ in range(round(6.0 / STEP)):
        if runner.snapshot.state.phase == "stopped":
            runner.ask(Release(by_person=True))
        runner.tick()
    assert kinds(runner).count("stop") == 1
    np.testing.assert_allclose(runner.snapshot.state.mood, mood, rtol=0.1)


def test_who_asks_for_a_release_too_early_waits_until_the_body_rests(runner: Runner) -> None:
    stop = block(runner).stop
    assert stop is not None
    runner.ask(MoveHand(None, np.array([0.0, 0.0, 1.0])))
    release = runner.ask(Release(by_person=True))
    given_up = runner.ask(Release(by_person=True))
    run(runner, 0.1)
    assert not release.done()
    given_up.cancel()
    state = until(runner, lambda state: state.phase == "returning", 2.0)
    release.result(0)
    assert 0.25 < state.time - stop.time < 0.9


def test_stop_makes_a_release_that_waits_void(runner: Runner) -> None:
    block(runner)
    release = runner.ask(Release(by_person=True))
    run(runner, 0.1)
    runner.stop()
    assert {state.phase for state in run(runner, 3.0)} == {"stopped"}
    with pytest.raises(BodyError, match="Stop was pressed after"):
        release.result(0)


@pytest.mark.parametrize("by_person", [True, False])
def test_stop_release_and_stop_within_one_step_end_with_a_stop(
    runner: Runner, by_person: bool
) -> None:
    first, later = (press("program", letter * 24) for letter in "ab")
    runner.stop(first)
    release = runner.ask(Release(by_person=by_person))
    runner.stop(later)
    assert {(state.phase, state.held) for state in run(runner, 1.0)} == {("stopped", True)}
    with pytest.raises(BodyError, match="Stop was pressed after"):
        release.result(0)
    release = runner.ask(Release(by_person=by_person))
    runner.stop(later)  # the second copy of a press is no new one
    until(runner, lambda state: state.phase != "stopped")
    release.result(0)


def test_the_second_copy_of_a_waiting_stop_keeps_no_release_from_running(runner: Runner) -> None:
    runner.stop(press("person", 24 * "a"))
    release = runner.ask(Release(by_person=True))
    runner.stop(press("person", 24 * "a"))
    until(runner, lambda state: state.phase != "stopped")
    release.result(0)


def test_only_a_person_may_cut_the_pause_after_a_contact_short(runner: Runner) -> None:
    block(runner)
    run(runner, 0.5)
    refused = runner.ask(Release())
    runner.tick()
    with pytest.raises(BodyError, match=r"in 0\.5 s"):
        refused.result(0)
    asked = runner.ask(Release(by_person=True))
    runner.tick()
    asked.result(0)
    assert runner.snapshot.state.phase == "returning"


def test_stop_during_a_contact_stop_holds_until_release(runner: Runner) -> None:
    block(runner)
    runner.stop()
    runner.ask(MoveHand(None, np.array([0.0, 0.0, 1.0])))
    assert not runner.snapshot.state.held
    assert {(state.phase, state.held) for state in run(runner, 20.0)} == {("stopped", True)}
    runner.ask(Pause(True))  # nor does this release it
    assert {(state.phase, state.held) for state in run(runner, 1.0)} == {("stopped", True)}
    runner.ask(Release(by_person=True))
    until(runner, lambda state: state.phase == "idle")


def test_a_pause_brings_the_body_to_neutral_and_ends(runner: Runner) -> None:
    runner.ask(Feel(Stimulus("thrill", 1.0)))
    until(runner, lambda state: state.phase == "moving")
    runner.ask(Pause(True))
    until(runner, lambda state: state.phase == "idle")
    for state in run(runner, 1.5):
        assert state.paused
        assert state.phase == "idle"
        np.testing.assert_allclose(state.angles, runner.robot.neutral, atol=0.03)
    refused = runner.ask(Perform(Expression("happiness", 0.5)))
    runner.tick()
    with pytest.raises(BodyError, match="paused"):
        refused.result(0)
    runner.ask(Pause(False))
    until(runner, lambda state: state.phase == "moving")
    assert [k for k in kinds(runner) if k in ("paused", "resumed")] == ["paused", "resumed"]


def test_stop_is_taken_however_many_commands_wait_and_runs_first(runner: Runner) -> None:
    runner.stop()
    run(runner, 1.0)
    release = runner.ask(Release(by_person=True))
    for _ in range(WAITING - 1):
        runner.ask(Feel(Stimulus("fear", 0.1)))
    with pytest.raises(BusyError):
        runner.ask(Feel(Stimulus("fear", 0.1)))
    stops = {id(runner.stop()) for _ in range(1000)}
    assert len(stops) == 1  # a flood of Stops takes no memory
    runner.stop().cancel()  # giving up the wait does not cancel the Stop
    runner.tick()
    assert runner.snapshot.state.phase == "stopped"
    with pytest.raises(BodyError, match="Stop was pressed after"):
        release.result(0)
    assert {state.phase for state in run(runner, 0.1)} == {"stopped"}


def test_recordings_are_whole_when_they_end(runner: Runner) -> None:
    recordings = runner.recordings
    recordings.start()
    runner.ask(Feel(Stimulus("happiness", 0.9)))
    run(runner, 2.0)
    assert runner.snapshot.state.recording == "miburi-0001.mcap"
    assert [kept.whole for kept in recordings.kept()] == [False]
    recordings.end()
    run(runner, STEP)
    assert [kind for kind in kinds(runner) if "record" in kind] == ["recording", "recorded"]
    assert [(kept.name, kept.whole) for kept in recordings.kept()] == [("miburi-0001.mcap", True)]
    topics = [message.topic for message in read(recordings.find("miburi-0001.mcap"))]
    assert topics.count("/joint_states") == 100
    assert topics.count("/feelings") == 20
    assert "/commands" in topics
    recordings.start()
    runner.tick()
    runner.close()
    assert [kept.whole for kept in recordings.kept()] == [True, True]


@pytest.mark.parametrize("body", [name for name, kind in KINDS.items() if not kind.needs_port])
def test_another_body_starts_at_neutral_and_the_old_one_is_stopped_and_closed(
    runner: Runner, body: str
) -> None:
    if not KINDS[body].available:
        pytest.skip("its firmware has not been built")
    runner.ask(Feel(Stimulus("thrill", 1.0)))
    run(runner, 1.0)
    before, old, closed = runner.snapshot.state, runner.body, []
    close = old.close
    old.close = lambda: closed.append(close())
    runner.ask(ChangeBody(body))
    runner.tick()
    assert (len(closed), old.state.phase) == (1, "stopped")
    state = runner.snapshot.state
    assert before.time < state.time < before.time + 0.1
    np.testing.assert_allclose(state.angles, runner.robot.neutral, atol=0.02)
    np.testing.assert_allclose(state.mood, before.mood, rtol=0.01)
    runner.stop()
    stop = until(runner, lambda state: state.stop).stop
    assert stop is not None
    assert state.time <= stop.time <= runner.snapshot.state.time


def test_a_change_of_bodies_releases_no_stop(runner: Runner) -> None:
    runner.stop()
    run(runner, 1.0)
    runner.ask(ChangeBody("simulated"))
    assert {(state.phase, state.held) for state in run(runner, 3.0)} == {("stopped", True)}
    runner.ask(Release(by_person=True))
    until(runner, lambda state: state.phase == "idle")


def test_a_change_of_bodies_shortens_no_pause_after_a_contact(runner: Runner) -> None:
    block(runner)
    runner.ask(ChangeBody("simulated"))
    run(runner, 0.5)
    refused = runner.ask(Release())
    runner.tick()
    with pytest.raises(BodyError, match=r"in 0\.[45] s"):
        refused.result(0)
    assert {state.phase for state in run(runner, 0.4)} == {"stopped"}
    run(runner, 0.2)
    runner.ask(Release())
    until(runner, lambda state: state.phase == "idle")


def test_another_body_goes_on_after_the_pause_unless_a_person_stops_it(runner: Runner) -> None:
    block(runner)
    runner.ask(ChangeBody("simulated"))
    runner.tick()
    assert not runner.held
    until(runner, lambda state: state.phase == "idle", seconds=5.0)
    block(runner)
    runner.ask(ChangeBody("simulated"))
    run(runner, 0.1)
    runner.stop()
    assert {(state.phase, state.held) for state in run(runner, 5.0)} == {("stopped", True)}


def test_a_command_that_the_body_refuses_does_not_end_the_loop(
    runner: Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(move: object) -> None:
        raise BodyError("not now")

    runner.ask(Feel(Stimulus("happiness", 0.9)))
    with monkeypatch.context() as patch:
        patch.setattr(runner.body, "move", refuse)
        run(runner, 2.0)
        (said,) = [entry.name for entry in runner.history.after(0) if entry.kind == "refused"]
        assert said == "not now"
    runner.ask(Feel(Stimulus("happiness", 0.9)))
    until(runner, lambda state: state.phase == "moving")


def test_only_ports_that_the_system_lists_or_the_user_named_are_opened(
    robot: Robot, tmp_path: Path
) -> None:
    runner = Runner(robot, EmotionalModel(), Archive(tmp_path), port="/dev/no-such-port")
    for port in ("/etc/passwd", "/nowhere", "/dev/ptmx", "socket://localhost:1"):
        with pytest.raises(InputError, match="not a serial port that this computer lists"):
            runner.ask(ChangeBody("card", port))
    runner.ask(ChangeBody("simulated"))
    runner.tick()
    with pytest.raises(BodyError, match="cannot be reached"):
        runner.ask(ChangeBody("card", "/dev/no-such-port"))


def test_closing_brings_the_body_home(live: Runner) -> None:
    live.ask(Feel(Stimulus("thrill", 1.0))).result(60)
    live.close()
    np.testing.assert_allclose(live.snapshot.state.angles, live.robot.neutral, atol=0.03)
    assert live.snapshot.state.phase == "idle"


def test_closing_leaves_a_stopped_body_where_it_is(live: Runner) -> None:
    live.ask(Feel(Stimulus("thrill", 1.0))).result(60)
    wait_until(lambda: live.snapshot.state.extent >= 0.02)
    live.stop()  # and nobody has waited for it
    stopped = live.snapshot.state.angles
    live.close()
    state = live.snapshot.state
    assert (state.phase, state.held, live.at_home) == ("stopped", True, False)
    np.testing.assert_allclose(state.angles, stopped, atol=0.1)
    assert np.abs(np.subtract(state.angles, live.robot.neutral)).max() > 0.05
