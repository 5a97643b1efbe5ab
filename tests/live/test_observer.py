"""What viewers are told of bodies that know more, or less, than the simulated one."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from tests.fixtures.live import block, run, until

from miburi.errors import BodyError
from miburi.feelings import FEELINGS, EmotionalModel, Stimulus, shipped_temperament
from miburi.live.observer import Observer
from miburi.live.recording.archive import Archive
from miburi.live.runner import Runner
from miburi.live.wishes import Feel, Release
from miburi.partner import MoveSent, Stopped
from miburi.robot import JOINTS, Robot
from miburi.safety.contact import Window
from miburi.safety.profile import FINE
from miburi.safety.stop import Phase, Stop, StopReason


@pytest.fixture
def card(robot: Robot, tmp_path: Path, firmware: Path) -> Runner:
    """A partner on the emulated card; time passes when a test calls ``tick``."""
    feelings = EmotionalModel(shipped_temperament("playful"))
    feelings.set_state(mood=dict.fromkeys(FEELINGS, 0.6))
    return Runner(robot, feelings, Archive(tmp_path / "recordings"), body="emulated-card")


def test_simulated_motors_have_guards_and_nothing_else(runner: Runner) -> None:
    told = runner.motors
    assert (told.body, told.calibrated, told.settings, told.hottest) == (
        "simulated", False, None, None,
    )  # fmt: skip
    guards = runner.robot.guards
    for i, motor in enumerate(told.motors):
        assert (motor.temperature, motor.voltage, motor.answers) == (None, None, None)
        assert motor.guards.lag == pytest.approx(guards.lag[i])
        assert motor.guards.slack == pytest.approx(guards.slack[i], abs=runner.robot.servo.step)


def test_a_card_tells_how_its_motors_are(card: Runner) -> None:
    told = card.motors
    assert [motor.joint for motor in told.motors] == list(JOINTS)
    assert [motor.servo for motor in told.motors] == list(range(1, 9))
    assert {(m.answers, m.temperature, m.voltage) for m in told.motors} == {(True, 35.0, 5.0)}
    assert (told.hottest, told.lowest, told.calibrated) == (65.0, 4.2, False)
    body = card.body
    body.stop()
    joints = tuple(
        replace(joint, guards=replace(joint.guards, slack=joint.guards.slack + 1))
        for joint in body.settings.joints
    )
    body.configure(replace(body.settings, joints=joints))
    run(card, 1.0)
    assert card.motors.calibrated
    assert card.motors.settings == f"{body.settings.crc:04x}"


def test_a_contact_of_a_card_is_explained(card: Runner) -> None:
    stop = block(card).stop
    assert stop is not None
    assert stop.reason == "contact"
    if stop.sign == "speed":
        assert stop.measured / stop.expected == pytest.approx(stop.ratio, abs=0.01)
        assert 0.05 < stop.expected < card.robot.servo.max_speed
    assert stop.force is not None
    assert stop.moved is not None
    assert stop.due is not None
    assert stop.moved / stop.due == pytest.approx(stop.ratio, abs=0.01)
    ratios = card.snapshot.state.ratios
    judged = {joint: r for joint, r in zip(JOINTS, ratios, strict=True) if r is not None}
    assert list(judged) == [stop.motor]
    assert stop.sign != "speed" or stop.ratio <= judged[stop.motor] < 0.9372


def test_a_card_that_is_lost_is_said_and_found_again(card: Runner) -> None:
    card.ask(Feel(Stimulus("happiness", 0.9)))
    until(card, lambda state: state.phase == "moving")
    line, write = card.body.emulation, card.body.emulation.write

    def broken(data: bytes = b"") -> bytes:
        raise OSError("unplugged")

    read, line.read, line.write = line.read, broken, broken
    line.close = lambda: None  # a processor that was switched off for good cannot be found again
    state = until(card, lambda state: state.stop)
    assert state.stop.reason == StopReason.LINE_LOST
    run(card, 1.1)
    assert {motor.answers for motor in card.motors.motors} == {False}
    refused = card.ask(Release())
    card.tick()
    with pytest.raises(BodyError):
        refused.result(0)
    line.read, line.write = read, write
    run(card, 2.0)
    assert {motor.answers for motor in card.motors.motors} == {True}
    card.ask(Release())
    until(card, lambda state: state.phase == "moving")


def observed(robot: Robot) -> tuple[Observer, SimpleNamespace]:
    """Return an observer of a body that has moved, and the body, whose window a test chooses."""
    state = SimpleNamespace(phase=Phase.MOVING, velocities=np.full(8, -0.3))
    body = SimpleNamespace(robot=robot, state=state, window=None, touchable=None)
    return Observer("simulated", None, SimpleNamespace(body=body), EmotionalModel()), body


def halfway(robot: Robot, length: int) -> Window:
    """Return a window of ``length`` µs in which a motor went half of 0.1 rad."""
    way = np.full(8, round(0.1 / robot.servo.step) * FINE, dtype=np.int64)
    return Window(way // 2, way, way // 2, np.arange(8) == 2, np.full(8, length))


def test_speeds_are_those_of_the_window_that_was_judged(robot: Robot) -> None:
    """A slow motor is judged over several periods, a fast one within one."""
    observer, body = observed(robot)
    stopped = Stopped(1.0, Stop(1.0, StopReason.CONTACT, JOINTS[2], "speed", 0.5), 0.5, 0.4)
    for length in (30_000, 100_000, 300_000):
        body.window = halfway(robot, length)
        told = observer.take([stopped])
        assert told.expected == pytest.approx(0.1e6 / length, rel=0.01)
        assert told.measured == pytest.approx(told.expected / 2, rel=0.01)
        assert told.due == pytest.approx(0.1, abs=1e-3)


def test_a_motor_far_from_its_path_is_compared_with_the_speed_that_was_sent(
    robot: Robot,
) -> None:
    observer, body = observed(robot)
    stopped = Stopped(1.0, Stop(1.0, StopReason.CONTACT, JOINTS[2], "tracking", 0.8), 0.5, 0.4)
    told = observer.take([stopped])
    assert (told.measured, told.expected, told.ratio) == (None, None, 0.8)
    observer.take([MoveSent(0.0, 0, SimpleNamespace(speeds=np.full(8, 0.9)), None)])
    body.window = halfway(robot, 500_000)
    told = observer.take([stopped])
    assert (told.measured, told.expected) == (0.3, 0.9)
    assert (told.moved, told.due) == pytest.approx((0.05, 0.1), abs=1e-3)


def test_a_pushed_motor_that_had_nowhere_to_go_has_no_ratio(
    runner: Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The rule saw it by where it was: nothing was expected of it."""
    way = np.full(8, 60 * FINE, dtype=np.int64)
    pushed = Window(way, 0 * way, way, np.arange(8) == 4, np.full(8, 100_000))
    monkeypatch.setattr(type(runner.body), "window", pushed)
    runner.tick()
    assert runner.snapshot.state.ratios == [None] * 8
