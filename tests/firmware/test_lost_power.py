"""A robot that loses its bus or its power: limp is never called held, and no arm jumps back."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.firmware.endings import raise_arms, recovers
from tests.firmware.rig import Rig
from tests.firmware.toolchain import changed_card

from miburi.card.card import wake
from miburi.card.link import Reason, Report
from miburi.robot import JOINTS
from miburi.safety.stop import Phase, StopReason

#: s within which a limp body is named.
NAMED = 0.3
#: What an arm may do unasked after a loss: steps (2°), and steps/s (0.3 rad/s).
FAR, FAST = 2 / 360 * 4096, 0.3 / 2 / np.pi * 4096


def never_held_without_torque(rig: Rig) -> None:
    """Let every report be looked at: held means that all have had torque a moment ago."""
    lost_at: float | None = None

    def see(report: Report) -> None:
        nonlocal lost_at
        if all(servo.get("torque_enable") == 1 and not servo.dead for servo in rig.servos):
            lost_at = None
        elif lost_at is None:
            lost_at = report.time
        else:
            assert not report.held or report.time - lost_at < NAMED * 1e6

    rig.body.on_report = see


def stop_by_contact(rig: Rig) -> None:
    raise_arms(rig)
    rig.servos[1].shaft.low = rig.servos[1].shaft.high = rig.servos[1].shaft.place
    rig.run(0.3)
    rig.servos[1].shaft.low, rig.servos[1].shaft.high = -np.inf, np.inf
    assert rig.body.state.stop.reason is StopReason.CONTACT


@pytest.mark.parametrize("stop", [lambda rig: rig.body.stop(), stop_by_contact])
def test_a_stopped_body_of_which_a_servo_restarts_is_named(
    rig: Rig, stop: Callable[[Rig], None]
) -> None:
    never_held_without_torque(rig)
    for motor in (0, 5, 7):
        stop(rig)
        rig.run(0.3)
        assert rig.body.report.held
        rig.servos[motor].power_up()
        rig.run(NAMED)
        assert rig.cause == (StopReason.SERVO_RESTARTED, JOINTS[motor])
        assert not rig.body.report.held
        wake(rig.body)


def test_a_stopped_body_without_its_supply_is_named_off_and_on(rig: Rig) -> None:
    never_held_without_torque(rig)
    for off in (0.04, 1.0):
        rig.body.stop()
        rig.run(0.1)
        assert rig.body.report.held
        for servo in rig.servos:
            servo.dead = True
        rig.run(off)
        if off > NAMED:
            assert rig.body.state.stop.reason is StopReason.SERVO_SILENT
        for servo in rig.servos:
            servo.dead = False
            servo.power_up()
        rig.run(NAMED)
        assert rig.body.state.stop.reason is StopReason.SERVO_RESTARTED
        assert not rig.body.report.held
        assert [servo.get("torque_enable") for servo in rig.servos] == [0] * 8
        wake(rig.body)


def test_a_body_that_was_never_held_or_was_let_go_is_not_named(firmware: Path) -> None:
    rig = Rig(firmware, awake=False, twin=False)
    never_held_without_torque(rig)
    rig.run(0.5)
    assert not rig.body.report.held
    assert rig.body.state.stop.reason is StopReason.CARD_STARTED
    wake(rig.body)
    rig.body.stop()
    rig.body.relax()
    rig.run(0.5)
    assert not rig.body.report.held
    assert rig.body.state.stop.reason is StopReason.ASKED
    wake(rig.body)
    rig.line.mega.reset()  # the servos keep their torque
    rig.run(2.0)
    assert rig.body.state.stop.reason is StopReason.CARD_STARTED
    assert rig.body.report.held
    rig.close()


@pytest.mark.parametrize("phase", [Phase.IDLE, Phase.MOVING, Phase.STOPPED])
def test_an_undervoltage_that_latches_on_all_servos_is_named_at_once(
    rig: Rig, phase: Phase
) -> None:
    """At whatever moment of the 20 ms between two readings."""
    never_held_without_torque(rig)
    for late in (0, 7_000, 14_000):
        if phase is Phase.MOVING:
            raise_arms(rig)
        elif phase is Phase.STOPPED:
            rig.body.stop()
            rig.run(0.1)
        rig.line.run(rig.line.mega.time + late)
        for servo in rig.servos:
            servo.fail(1)
        rig.run(0.1)
        assert rig.body.state.stop.reason is StopReason.SERVO_FAULTY
        assert not rig.body.report.held
        for servo in rig.servos:
            servo.power_up()
        rig.run(0.1)
        wake(rig.body)


def test_a_servo_that_restarts_in_motion_is_no_contact(rig: Rig) -> None:
    reasons = set[int]()
    rig.body.on_report = lambda report: reasons.add(report.reason)
    for motor, seconds in ((1, 0.3), (4, 0.7)):
        rig.turn([1, 4], by=1.5, speed=1.0)
        rig.run(seconds)
        reasons.clear()
        rig.servos[motor].power_up()
        rig.run(NAMED)
        assert reasons <= {Reason.NONE, Reason.RESTARTED}
        assert rig.cause == (StopReason.SERVO_RESTARTED, JOINTS[motor])
        wake(rig.body)


def test_torque_that_is_lost_in_motion_is_noticed(rig: Rig) -> None:
    """A servo that is not to move, or moves slowly, hides from the rule that it is limp."""
    rig.turn([1], by=0.5, speed=0.2)
    rig.run(0.5)
    rig.servos[6].set("torque_enable", 0)
    rig.run(NAMED)
    assert rig.cause == (StopReason.SERVO_RESTARTED, JOINTS[6])


def goes_back_little(rig: Rig, start: np.ndarray, seconds: float, ends: float) -> None:
    """Nobody asks for anything: servos stop, and go back by 2° at most, and slowly.

    For ``ends`` s a move may still be under way.
    """
    times, track = [], []
    for _ in range(round(seconds / 0.01)):
        now = rig.line.mega.time
        track.append([servo.setpoint(now) for servo in rig.servos])
        times.append(now)
        rig.line.run(now + 10_000)
    way, spans = np.array(track), np.diff(times)[:, None] / 1e6
    rest = round(ends / 0.01)
    assert np.abs(way[rest:] - way[rest]).max() <= FAR
    assert np.abs(np.diff(way[rest:], axis=0) / spans[rest:]).max() <= FAST
    forward = way * np.sign(way[0] - start)
    assert (np.maximum.accumulate(forward) - forward).max() <= FAR
    assert -(np.diff(forward, axis=0) / spans).min() <= FAST


def swing_arms(rig: Rig, speed: float) -> np.ndarray:
    """Begin a long move of both arms; return where all were before it."""
    start = np.array([servo.shaft.place for servo in rig.servos])
    rig.turn([1, 4], by=2.0, speed=speed)
    rig.run(0.2)
    assert rig.body.state.phase is Phase.MOVING
    return start


#: s for which the bus is away, and rad/s.
LOSSES = [(0.09, 3.0), (0.15, 1.0), (0.19, 3.0), (3.0, 3.0)]


@pytest.mark.parametrize(("away", "speed"), LOSSES)
def test_no_arm_jumps_back_when_the_bus_returns(rig: Rig, away: float, speed: float) -> None:
    """What was last read is old: the servos went on, until their own watchdogs stopped them."""
    start = swing_arms(rig, speed)
    rig.bus.spoil = lambda _: b""
    rig.line.run(rig.line.mega.time + away * 1e6)
    rig.bus.spoil = lambda data: data
    goes_back_little(rig, start, 1.5, 0.12)
    rig.body.step(0.1)
    assert rig.body.state.stop.reason is StopReason.SERVO_SILENT
    assert rig.body.report.held
    recovers(rig)


def test_no_other_arm_jumps_back_when_a_servo_is_unplugged(rig: Rig) -> None:
    start = swing_arms(rig, 3.0)
    rig.servos[6].dead = True
    goes_back_little(rig, start, 0.6, 0.2)
    assert rig.body.look().stop.reason is StopReason.SERVO_SILENT


def test_a_held_body_whose_bus_was_away_is_held_again(rig: Rig) -> None:
    """Their own watchdogs have stopped the servos, which then take no more orders."""
    raise_arms(rig)
    rig.body.stop()
    rig.run(0.2)
    before = [servo.shaft.place for servo in rig.servos]
    rig.bus.spoil = lambda _: b""
    rig.run(0.5)
    assert not rig.body.report.held
    assert {
        servo.setpoint(rig.line.mega.time) and servo.get("bus_watchdog") for servo in rig.servos
    } == {-1}
    rig.bus.spoil = lambda data: data
    rig.run(0.3)
    assert rig.body.report.held
    assert {servo.get("bus_watchdog") for servo in rig.servos} == {10}
    assert np.abs(np.subtract([servo.shaft.place for servo in rig.servos], before)).max() < 1
    recovers(rig)


#: Changes to the firmware (file, old, new), by what the changed card would do.
MUTANTS = {
    "goes back to where it was read last": (
        "body.h", "hold_.unpin(ALL);  // what was read last may be old", ";"
    ),
    "keeps its first reason": ("body.h", "kept && (limp ||", "kept && (false ||"),
    "calls a limp servo held": (
        "body.h", "hold_.set_loose(static_cast<uint8_t>(hold_.loose() | (1u << motor)));", ";"
    ),
    "looks at nobody's torque": (
        "health.h", "if ((loose & (1u << motor)) ||", "if (loose != 1 || motor != 1 ||"
    ),
}  # fmt: skip


@pytest.mark.proof("test_a_stopped_body_of_which_a_servo_restarts_is_named")
@pytest.mark.parametrize("name", MUTANTS)
def test_a_card_that_misses_a_loss_is_noticed(firmware: Path, tmp_path: Path, name: str) -> None:
    rig = Rig(changed_card(tmp_path, *MUTANTS[name]), twin=False)
    with pytest.raises(AssertionError):
        test_a_stopped_body_of_which_a_servo_restarts_is_named(rig, stop_by_contact)
        for away, speed in LOSSES:
            test_no_arm_jumps_back_when_the_bus_returns(rig, away, speed)
    rig.close()
