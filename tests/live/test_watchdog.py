"""What happens to the body, and to those who look at it, when the loop fails or hangs."""

import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest
from tests.fixtures.live import until as run_until
from tests.fixtures.waiting import until

from miburi.bodies import BodyState
from miburi.feelings import EmotionalModel, Expression, Stimulus, shipped_temperament
from miburi.live.events.event import LiveEvent
from miburi.live.recording.archive import Archive
from miburi.live.runner import STEP, Runner
from miburi.live.watchdog import Lateness, Watchdog
from miburi.live.wishes import Feel, Perform
from miburi.robot import Robot
from miburi.safety.stop import Phase, StopReason


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def attentive(robot: Robot, folder: Path, **more: Any) -> Runner:
    """A partner that the watchdog stops as soon as a user's; a test makes its loop late."""
    return Runner(robot, EmotionalModel(shipped_temperament("playful")), Archive(folder), **more)


def stops(runner: Runner) -> list[LiveEvent]:
    return [entry for entry in runner.history.after(0) if entry.kind == "stop"]


#: Prints the functions that are compiled, or read from the cache, in the loop's thread.
LATE = """
import threading
from pathlib import Path
from numba.core.dispatcher import Dispatcher
from tests.fixtures.live import PATIENT
from tests.fixtures.waiting import until
from miburi.feelings import EmotionalModel, Expression
from miburi.live.recording.archive import Archive
from miburi.live.runner import Runner
from miburi.live.wishes import Perform
from miburi.robot import iphonoid

compile = Dispatcher.compile

def told(function, signature):
    if threading.current_thread().name == "partner":
        print(function.__name__)
    return compile(function, signature)

Dispatcher.compile = told
runner = Runner(iphonoid(), EmotionalModel(), Archive(Path("unused")), lateness=PATIENT)
runner.ask(Perform(Expression("happiness", 1.0)))
runner.start()
until(lambda: "gesture_ended" in [event.kind for event in runner.history.after(0)])
runner.close()
"""


def test_the_loop_does_not_wait_for_code_to_be_compiled() -> None:
    """It took half a second at the first start of all, and the watchdog stopped the body."""
    words, root = [sys.executable, "-c", LATE], Path(__file__).parents[2]
    done = subprocess.run(words, cwd=root, stdout=subprocess.PIPE, text=True, check=True)
    assert done.stdout == ""


def test_a_late_beat_is_told_once_and_a_beat_ends_it() -> None:
    clock, told, (late, dead) = Clock(), list[str](), Lateness()
    dog = Watchdog(STEP, lambda: told.append("late"), lambda: told.append("dead"), clock=clock)
    clock.now = STEP + late
    dog.look()
    assert told == []
    for clock.now in (STEP + late + 0.01, 2 * late, dead):
        dog.look()
    assert told == ["late"]
    dog.beat()
    clock.now += 2 * late
    dog.look()
    clock.now += dead
    for _ in range(3):
        dog.look()
    assert told == ["late", "late", "dead"]


@pytest.mark.parametrize(("apart", "blamed"), [(True, []), (False, ["late"])])
def test_who_slept_itself_blames_no_other_process(apart: bool, blamed: list[str]) -> None:
    """A closed laptop: the server answers as soon as both are awake."""
    clock, told = Clock(), list[str]()
    dog = Watchdog(3.0, lambda: told.append("late"), lambda: None, clock=clock, apart=apart)
    for clock.now in (1.0, 2.0, 600.0):
        dog.look()
    assert told == blamed
    for clock.now in (601.0, 602.0, 603.5):  # now it is late
        dog.look()
    assert told == ["late"]


def test_while_the_loop_hangs_the_body_is_stopped_and_everybody_sees_it(
    robot: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    runner = attentive(robot, tmp_path)
    hang, halted, step = threading.Event(), threading.Event(), runner.body.step

    def hangs(dt: float) -> BodyState:
        hang.wait()
        return step(dt)

    with monkeypatch.context() as patch:
        patch.setattr(runner.body, "step", hangs)
        patch.setattr(runner.body, "halt", halted.set)
        asked = runner.ask(Feel(Stimulus("fear", 0.1)))
        runner.start()
        assert halted.wait(60)
        stop = until(lambda: runner.snapshot.state.stop)
        assert stop is not None
        assert (runner.snapshot.state.phase, stop.reason) == ("stopped", StopReason.LOOP_LATE)
        asked.result(60)  # it has been taken; its step hangs
    hang.set()
    until(lambda: stops(runner))
    assert runner.body.state.phase == "stopped"
    (entry,) = stops(runner)
    assert entry.name == StopReason.LOOP_LATE
    assert runner.failure is None
    runner.close(patience=0.0)


def test_a_card_is_stopped_while_the_loop_hangs_in_the_middle_of_a_move(
    robot: Robot, tmp_path: Path, firmware: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    runner = attentive(robot, tmp_path, body="emulated-card")
    runner.ask(Perform(Expression("happiness", 1.0)))
    run_until(runner, lambda state: state.asked and state.hand_speed > 0.05)
    hang, begun, step = threading.Event(), threading.Event(), runner.body.step

    def hangs(dt: float) -> BodyState:
        begun.set()
        hang.wait()
        return step(dt)

    with monkeypatch.context() as patch:
        patch.setattr(runner.body, "step", hangs)
        runner.start()
        assert begun.wait(60)
        until(lambda: runner.snapshot.state.stop)
    # Where the body is, not where the latest report saw it: that is up to 20 ms old.
    touchable = runner.body.touchable
    assert touchable is not None
    before = touchable.configuration[0].copy()
    patched = step(0.06)  # the card goes on by itself; nobody has told the partner
    assert patched.phase is Phase.STOPPED
    assert abs(touchable.configuration[0] - before).max() < 0.1
    hang.set()
    (entry,) = until(lambda: stops(runner))
    assert entry.name == StopReason.LOOP_LATE
    assert not runner.held
    runner.close(patience=0.0)


def test_a_loop_that_is_late_again_in_its_next_step_has_still_stopped_the_body_itself(
    robot: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a busy computer the stop was taken for a person's, and lasted until somebody came."""
    runner = attentive(robot, tmp_path)
    runner.ask(Perform(Expression("happiness", 1.0)))
    run_until(runner, lambda state: state.phase == "moving")
    step = runner.body.step

    def late_again(dt: float) -> BodyState:
        runner.halt()
        return step(dt)

    runner.halt()
    with monkeypatch.context() as patch:
        patch.setattr(runner.body, "step", late_again)
        runner.tick()
    (entry,) = stops(runner)
    assert entry.name == StopReason.LOOP_LATE
    run_until(runner, lambda state: state.phase == "idle")


def test_a_step_that_raises_stops_the_body_and_the_loop_goes_on(
    live: Runner, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fail(dt: float) -> BodyState:
        raise ZeroDivisionError("a mistake of ours")

    with monkeypatch.context() as patch:
        patch.setattr(live.body, "step", fail)
        live.ask(Feel(Stimulus("fear", 0.1))).result(60)  # who asks is answered all the same
        until(lambda: "loop_failed" in [entry.kind for entry in live.history.after(0)])
        until(lambda: live.snapshot.state.phase == "stopped")
    assert "in fail\n    raise ZeroDivisionError" in caplog.text
    assert caplog.text.count("Traceback") == 1, "what repeats is told once"
    until(lambda: stops(live) or live.failure)
    if live.failure is None:
        assert live.body.state.phase == "stopped"


def test_a_loop_whose_every_step_fails_is_given_up_with_a_word(
    runner: Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(dt: float) -> BodyState:
        raise ZeroDivisionError("a mistake of ours")

    given_up = threading.Event()
    monkeypatch.setattr(runner.body, "step", fail)
    runner.start(on_failure=given_up.set)
    assert given_up.wait(60)
    assert "a mistake of ours" in str(runner.failure)
    runner.close()
    assert runner.snapshot.state.phase == "stopped"


def test_a_loop_that_hangs_for_good_does_not_hang_its_end(
    robot: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    runner = attentive(robot, tmp_path, lateness=Lateness(give_up=0.3))
    hang, given_up = threading.Event(), threading.Event()
    monkeypatch.setattr(runner.body, "step", lambda dt: hang.wait())
    runner.start(on_failure=given_up.set)
    assert given_up.wait(60)
    assert "hangs" in str(runner.failure)
    runner.close()
    hang.set()
