"""What happens to the body, and to who looks at it, when the loop fails or hangs."""

import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from miburi.bodies import BodyState
from miburi.feelings import EmotionalModel, Expression, Stimulus, shipped_temperament
from miburi.live.archive import Archive
from miburi.live.runner import STEP, Runner
from miburi.live.watchdog import DEAD, LATE, Watchdog
from miburi.robot import Robot
from miburi.safety.stop import Phase, StopReason


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def until(wanted: Callable[[], object]) -> None:
    while not wanted():
        pass


def test_a_late_beat_is_told_once_and_a_beat_ends_it() -> None:
    clock, told = Clock(), list[str]()
    dog = Watchdog(STEP, lambda: told.append("late"), lambda: told.append("dead"), clock)
    clock.now = STEP + LATE
    dog.look()
    assert told == []
    for clock.now in (STEP + LATE + 0.01, 2 * LATE, DEAD):
        dog.look()
    assert told == ["late"]
    dog.beat()
    clock.now += 2 * LATE
    dog.look()
    clock.now += DEAD
    for _ in range(3):
        dog.look()
    assert told == ["late", "late", "dead"]


def test_while_the_loop_hangs_the_body_is_stopped_and_everybody_sees_it(
    runner: Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    hang, halted, step = threading.Event(), threading.Event(), runner.body.step

    def hangs(dt: float) -> BodyState:
        hang.wait()
        return step(dt)

    with monkeypatch.context() as patch:
        patch.setattr(runner.body, "step", hangs)
        patch.setattr(runner.body, "halt", halted.set)
        asked = runner.stimulate(Stimulus("fear", 0.1))
        runner.start()
        assert halted.wait(10)
        until(lambda: runner.snapshot.state.stop)
        stop = runner.snapshot.state.stop
        assert stop is not None
        assert (runner.snapshot.state.phase, stop.reason) == ("stopped", StopReason.LOOP_LATE)
        asked.result(5)  # it has been taken; its step hangs
    hang.set()
    until(lambda: [entry for entry in runner.log() if entry.kind == "stopped"])
    assert runner.body.state.phase == "stopped"
    (entry,) = [entry for entry in runner.log() if entry.kind == "stopped"]
    assert entry.name == StopReason.LOOP_LATE
    assert runner.failure is None
    runner.close(patience=0.0)


def test_a_card_is_stopped_while_the_loop_hangs_in_the_middle_of_a_move(
    robot: Robot, tmp_path: Path, firmware: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    feelings = EmotionalModel(shipped_temperament("playful"))
    runner = Runner(robot, feelings, Archive(tmp_path), body="emulated-card")
    runner.perform(Expression("happiness", 1.0))
    until(lambda: runner.tick() or (runner.snapshot.state.asked and moves(runner)))
    hang, begun, step = threading.Event(), threading.Event(), runner.body.step

    def hangs(dt: float) -> BodyState:
        begun.set()
        hang.wait()
        return step(dt)

    with monkeypatch.context() as patch:
        patch.setattr(runner.body, "step", hangs)
        runner.start()
        assert begun.wait(10)
        until(lambda: runner.snapshot.state.stop)
    # Where the body is, not where the latest report saw it: that is up to 20 ms old.
    touchable = runner.body.touchable
    assert touchable is not None
    before = touchable.configuration[0].copy()
    patched = step(0.06)  # the card goes on by itself; nobody has told the partner
    assert patched.phase is Phase.STOPPED
    assert abs(touchable.configuration[0] - before).max() < 0.1
    hang.set()
    until(lambda: [entry for entry in runner.log() if entry.kind == "stopped"])
    (entry,) = [entry for entry in runner.log() if entry.kind == "stopped"]
    assert entry.name == StopReason.LOOP_LATE
    assert not runner.held
    runner.close(patience=0.0)


def moves(runner: Runner) -> bool:
    return runner.snapshot.state.hand_speed > 0.05


def test_a_step_that_raises_stops_the_body_and_the_loop_goes_on(
    live: Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(dt: float) -> BodyState:
        raise ZeroDivisionError("a mistake of ours")

    with monkeypatch.context() as patch:
        patch.setattr(live.body, "step", fail)
        live.stimulate(Stimulus("fear", 0.1)).result(5)  # who asks is answered all the same
        until(lambda: "loop_failed" in [entry.kind for entry in live.log()])
        until(lambda: live.snapshot.state.phase == "stopped")
    until(lambda: "stopped" in [entry.kind for entry in live.log()] or live.failure)
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
    assert given_up.wait(30)
    assert "a mistake of ours" in str(runner.failure)
    runner.close()
    assert runner.snapshot.state.phase == "stopped"


def test_a_loop_that_hangs_for_good_does_not_hang_its_end(
    runner: Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    hang, given_up = threading.Event(), threading.Event()
    monkeypatch.setattr("miburi.live.watchdog.DEAD", 0.3)
    monkeypatch.setattr(runner.body, "step", lambda dt: hang.wait())
    runner.start(on_failure=given_up.set)
    assert given_up.wait(30)
    assert "hangs" in str(runner.failure)
    runner.close()
    hang.set()
