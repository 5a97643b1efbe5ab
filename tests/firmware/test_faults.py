"""Whatever fails, the robot ends at rest, and the host is told in words."""

import struct
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.firmware.endings import raise_arms, recovers
from tests.firmware.rig import Rig, calibrated

from miburi.bodies import Motor
from miburi.card.card import wake
from miburi.card.link import FrameKind
from miburi.errors import BodyError
from miburi.host.server import why_stopped
from miburi.robot import JOINTS
from miburi.safety.move import Move
from miburi.safety.stop import Phase, StopReason


def symbol(firmware: Path, name: str) -> int:
    said = subprocess.run(
        ["avr-nm", firmware / "miburi.elf"], capture_output=True, check=False, text=True
    )
    return next(
        int(line.split()[0], 16) for line in said.stdout.splitlines() if line.split()[-1] == name
    )


def turn_clock_on(rig: Rig, firmware: Path, seconds: float) -> None:
    """Let the card believe that time has passed: its timer overflows every 1024 µs."""
    overflows = symbol(firmware, "timer0_overflow_count") & 0xFFFF  # in data memory
    (count,) = struct.unpack("<I", rig.line.mega.peek(overflows, 4))
    count += round(seconds * 1e6 / 1024)
    rig.line.mega.poke(overflows, struct.pack("<I", count))


def stays_stopped(rig: Rig) -> None:
    assert rig.at_rest()
    assert rig.body.state.phase is Phase.STOPPED
    with pytest.raises(BodyError, match="stopped"):
        rig.body.move(Move(rig.robot.neutral, np.ones(8)))


def test_power_on_moves_nothing(firmware: Path) -> None:
    rig = Rig(firmware, awake=False, twin=False)
    for servo in rig.servos:
        servo.set("goal_position", 0)  # a trap: torque on would pull there at once
    before = [servo.shaft.place for servo in rig.servos]
    rig.run(1.0)
    assert rig.body.state.phase is Phase.STOPPED
    assert rig.cause == (StopReason.CARD_STARTED, None)
    assert [servo.get("torque_enable") for servo in rig.servos] == [0] * 8
    rig.body.release()
    for servo, place in zip(rig.servos, before, strict=True):
        assert servo.get("torque_enable") == 1
        # The first trajectory after torque began and ended where the shaft was.
        assert abs(servo.shaft.place - place) < 3
    assert rig.settle() is Phase.IDLE
    rig.close()


def test_host_killed_in_mid_move_lets_the_move_end(rig: Rig) -> None:
    raise_arms(rig)
    rig.line.run(rig.line.mega.time + 5e6)  # nobody says a word
    assert rig.at_rest()
    joint = rig.settings.joints[1]
    aim = rig.robot.neutral[1] + 1.2
    assert abs(rig.servos[1].shaft.place - joint.zero - aim / rig.robot.servo.step) < 5


def test_a_lost_host_leaves_no_body_under_full_torque(rig: Rig, firmware: Path) -> None:
    """At rest, after half a minute without a word from it: stopped, and held softly."""
    assert rig.settle() is Phase.IDLE
    turn_clock_on(rig, firmware, 20.0)
    rig.body.ask(FrameKind.STATUS, struct.pack("<H", 10))  # the half minute starts again
    turn_clock_on(rig, firmware, 29.5)
    rig.line.run(rig.line.mega.time + 0.3e6)
    limits = [servo.get("goal_pwm") for servo in rig.servos]
    rig.line.run(rig.line.mega.time + 0.5e6)
    hold = rig.settings.general.hold_pwm
    assert [servo.get("goal_pwm") for servo in rig.servos] == [hold] * 8 != limits
    assert [servo.get("torque_enable") for servo in rig.servos] == [1] * 8
    assert rig.body.look().phase is Phase.STOPPED
    assert rig.cause == (StopReason.LINE_LOST, None)
    recovers(rig)


def test_a_host_at_rest_shows_the_card_that_it_lives(rig: Rig) -> None:
    asked: list[FrameKind] = []
    rig.body.on_answer = lambda kind, *_: asked.append(kind)
    rig.run(5.5)
    assert asked == [FrameKind.STATUS]


def test_a_card_tells_how_its_servos_are_until_it_is_lost(firmware: Path) -> None:
    rig = Rig(firmware, awake=False, twin=False)
    assert rig.body.touchable is None
    assert rig.body.motors().rule.period == rig.settings.general.period
    # It looks at their health every half second; until then that is not known.
    assert rig.body.motors().each == tuple(Motor(i + 1, True) for i in range(8))
    rig.servos[4].dead = True
    rig.run(1.5)  # a dead servo is waited for at each reading, so their health comes later
    told = rig.body.motors()
    assert (told.hottest, told.lowest) == (65, 4.2)
    assert told.settings == f"{rig.settings.crc:04x}"
    assert [motor.answers for motor in told.each] == [i != 4 for i in range(8)]
    assert told.each[0] == Motor(1, True, 35, 5.0)
    said = why_stopped(rig.body)
    assert said is not None
    assert "the card has just started. No answer from: left shoulder (servo 5);" in said
    rig.line.pulled = True
    rig.run(0.1)
    assert rig.body.motors().each == tuple(Motor(i + 1, False) for i in range(8))
    rig.close()


def test_pulled_cable_is_a_stop_until_released(rig: Rig) -> None:
    raise_arms(rig)
    rig.line.pulled = True
    rig.run(2.0)
    assert rig.body.state.phase is Phase.STOPPED
    assert rig.cause == (StopReason.LINE_LOST, None)
    assert rig.at_rest()
    with pytest.raises(BodyError, match="cable|line"):
        rig.body.release()
    rig.line.pulled = False
    rig.run(1.2)
    stays_stopped(rig)
    recovers(rig)


def test_a_mute_card_is_heard_again_however_late_the_steps_are(rig: Rig) -> None:
    """A live partner's loop does not catch up after a long step. To open a port restarts a Mega."""

    def live(seconds: float) -> None:
        until = rig.line.now() + seconds
        while rig.line.now() < until:
            due = rig.line.now() + 0.02
            rig.body.step(0.02)
            rig.line.wait(due)

    rig.line.mute = True
    live(4.0)
    assert rig.cause == (StopReason.LINE_LOST, None)
    assert rig.line.closings == 0
    live(8.0)
    assert 1 <= rig.line.closings <= 2
    rig.line.mute = False
    live(2.0)
    assert rig.cause == (StopReason.LINE_LOST, None)
    recovers(rig)


def test_silent_card_is_a_stop_and_the_servos_stop_by_themselves(rig: Rig, firmware: Path) -> None:
    """A card that hangs: its watchdog resets it; before that, the servos' own one has bitten."""
    raise_arms(rig, speed=0.8)
    rig.line.mega.jump(symbol(firmware, "__stop_program"))
    resets = rig.line.mega.time
    rig.line.run(resets + 300_000)
    assert rig.servos[1].get("bus_watchdog") == -1 or rig.servos[1].setpoint(
        rig.line.mega.time
    ) == rig.servos[1].setpoint(rig.line.mega.time + 1e6)
    here = rig.servos[1].shaft.position(rig.servos[1], rig.line.mega.time)
    assert here < rig.servos[1].get("goal_position") - 50  # it did not go to the end
    rig.run(3.0)
    assert rig.body.state.phase is Phase.STOPPED
    assert rig.cause == (StopReason.CARD_STARTED, None)
    stays_stopped(rig)
    recovers(rig)


@pytest.mark.parametrize("saved", [True, False])
def test_card_reset_in_mid_move_ends_at_rest(rig: Rig, saved: bool) -> None:
    if saved:
        rig.body.stop()
        rig.body.save()
        wake(rig.body)
    raise_arms(rig, speed=0.8)
    rig.line.mega.reset()
    rig.line.run(rig.line.mega.time + 300_000)
    assert rig.at_rest()
    assert abs(rig.servos[1].shaft.place - rig.servos[1].get("goal_position")) < 60 or not saved
    rig.run(3.0)
    assert rig.body.state.phase is Phase.STOPPED
    assert rig.cause == (StopReason.CARD_STARTED, None)
    stays_stopped(rig)
    recovers(rig)


@pytest.mark.parametrize(
    ("motor", "entry", "value", "reason", "said"),
    [
        (0, None, 0, StopReason.SERVO_SILENT, "servo does not answer"),  # unplugged
        (4, None, 0, StopReason.SERVO_SILENT, "servo does not answer"),
        (7, None, 0, StopReason.SERVO_SILENT, "servo does not answer"),
        (5, "temperature", 65, StopReason.SERVO_HOT, "servo is too hot; let it cool"),
        (3, "voltage", 41, StopReason.LOW_VOLTAGE, "supply voltage is too low; use a stronger"),
    ],
)
def test_a_servo_that_fails_stops_all_and_is_named(
    rig: Rig, motor: int, entry: str | None, value: int, reason: StopReason, said: str
) -> None:
    raise_arms(rig, speed=0.8)
    servo = rig.servos[motor]
    if entry is None:
        servo.dead = True
        rig.run(0.3)
    else:
        fit = servo.get(entry)
        servo.set(entry, value)
        rig.run(0.7)
    assert rig.cause == (reason, JOINTS[motor])
    assert all(other.segment.acceleration == 0 for other in rig.servos if other is not servo)
    stays_stopped(rig)
    with pytest.raises(BodyError, match=f"{JOINTS[motor]}: {said}"):
        rig.body.release()
    if entry is None:
        servo.dead = False
        servo.power_up()
        rig.run(0.3)
    else:
        servo.set(entry, fit)
    recovers(rig)


def test_answers_that_are_lost_in_turn_do_not_starve_the_rule(rig: Rig) -> None:
    """Each servo is heard often enough, but never all at once: the rule would not look."""
    raise_arms(rig, speed=0.8)
    readings = 0
    missing = [rig.servos[motor].get("id") for motor in (2, 5)]

    def lose(data: bytes) -> bytes:
        nonlocal readings
        readings += data[7:9] == b"\x82\x80"  # a sync read from address 128
        return b"" if data[7:8] == b"\x55" and data[4] == missing[readings % 2] else data

    rig.bus.spoil = lose
    rig.run(0.2)
    rig.bus.spoil = lambda data: data
    assert rig.cause in [(StopReason.SERVO_SILENT, JOINTS[motor]) for motor in (2, 5)]
    rig.run(0.3)
    stays_stopped(rig)
    recovers(rig)


def test_a_lost_answer_makes_no_fast_move_look_wrong(rig: Rig) -> None:
    """Who was asked again alone, milliseconds later, had gone on, and seemed to be ahead."""
    ids = [rig.servos[motor].get("id") for motor in (1, 4, 7)]
    asked = 0
    to_lose: int | None = None

    def lose(data: bytes) -> bytes:
        nonlocal asked, to_lose
        if data[7:9] == b"\x82\x80":  # a sync read from address 128
            asked += 1
            to_lose = ids[asked // 3 % 3] if asked % 3 == 0 else None
        elif data[7:8] == b"\x55" and data[4] == to_lose:
            to_lose = None
            return data[:6] + data[7:]  # a byte
        return data

    rig.bus.spoil = lose
    for there in (2.6, 0.1, 2.6, 0.1):
        angles = rig.robot.neutral.copy()
        angles[[1, 4]] = there
        rig.body.move(Move(angles, np.full(8, rig.robot.servo.max_speed)))
        assert rig.settle() is Phase.IDLE, rig.body.state.stop
    assert asked > 60
    rig.bus.spoil = lambda data: data


def test_brown_out_of_the_bus(rig: Rig) -> None:
    raise_arms(rig)
    for servo in rig.servos:
        servo.dead = True
    rig.run(0.4)
    assert rig.body.state.stop.reason == StopReason.SERVO_SILENT
    for servo in rig.servos:
        servo.dead = False
        servo.power_up()
    rig.run(1.0)
    # Power is back, and nothing has torque until somebody says so.
    assert [servo.get("torque_enable") for servo in rig.servos] == [0] * 8
    stays_stopped(rig)
    recovers(rig)


def test_noisy_bus_stops_the_robot_or_lets_it_go_on(rig: Rig) -> None:
    raise_arms(rig)

    def spoil(data: bytes) -> bytes:
        broken = bytearray(data)
        for index in np.flatnonzero(rig.rng.random(len(data)) < 0.05):
            broken[index] ^= 1 << int(rig.rng.integers(8))
        return bytes(broken)

    rig.bus.spoil = spoil
    rig.run(2.0)
    rig.bus.spoil = lambda data: data
    rig.run(0.5)
    assert rig.at_rest()
    if rig.body.state.phase is Phase.STOPPED:
        wake(rig.body)
    raise_arms(rig)


def test_slow_answers_are_waited_for(rig: Rig) -> None:
    for servo in rig.servos:
        servo.delay = 800.0
    raise_arms(rig)
    assert rig.settle() is Phase.IDLE


def test_clock_that_wraps_in_mid_move_is_not_noticed(rig: Rig, firmware: Path) -> None:
    """After 71 minutes micros() begins anew: here in the middle of a move."""
    before = rig.body.report.time
    wraps = rig.line.mega.time + 3e6
    turn_clock_on(rig, firmware, (2**32 - wraps) / 1e6)
    rig.run(0.1)
    # For the card an hour has passed, and nobody has said a word.
    assert rig.cause == (StopReason.LINE_LOST, None)
    wake(rig.body)
    rig.run((wraps - rig.line.mega.time) / 1e6 - 0.2)
    raise_arms(rig)
    assert rig.line.mega.time > wraps
    assert rig.settle() is Phase.IDLE
    assert rig.body.report.time > before


def test_a_tap_on_stop_holds_softly(rig: Rig) -> None:
    raise_arms(rig)
    rig.body.stop()
    assert rig.body.state.stop.reason == StopReason.ASKED
    assert {servo.get("goal_pwm") for servo in rig.servos} == {222}
    assert rig.at_rest()
    recovers(rig)
    order = rig.body.underway.order
    assert order is not None
    assert [servo.get("goal_pwm") for servo in rig.servos] == order.cruise.tolist()


def test_a_stop_under_load_lets_nothing_sink_and_its_end_is_no_contact(rig: Rig) -> None:
    loads = (0, 12, 8, 4, -12, -8, -4, 12)
    for servo, load in zip(rig.servos, loads, strict=True):
        servo.shaft.load = float(load)
    rig.body.hung = tuple(-load for load in loads)
    rig.body.stop()  # loads that come at rest are a hand that pulls
    rig.run(0.4)
    wake(rig.body)
    raise_arms(rig)
    rig.run(0.3)
    rig.body.stop()
    rig.run(0.2)
    where = rig.body.report.positions
    rig.run(1.0)
    assert np.abs(np.subtract(rig.body.report.positions, where)).max() <= 1
    assert {servo.get("goal_pwm") for servo in rig.servos} == {222}
    wake(rig.body)
    assert rig.body.state.phase is Phase.IDLE


def test_a_soft_servo_hangs_by_more_than_the_host_says(firmware: Path) -> None:
    """Its share of the sag is the card's: three times what the description's servo would hang."""
    told = (0, 12, 10, -8, -12, -10, 8, 12)
    settings = calibrated()
    soft = replace(settings, joints=tuple(replace(joint, sag=768) for joint in settings.joints))
    rig = Rig(firmware, awake=False, settings=soft)
    rig.body.hung = told
    for servo, sag in zip(rig.servos, told, strict=True):
        servo.shaft.load = -3.0 * sag
    rig.body.step(0.04)
    wake(rig.body)
    raise_arms(rig)
    assert rig.settle() is Phase.IDLE, rig.body.state.stop
    assert rig.twin.looks > 30
    rig.body.stop()
    rig.body.configure(settings)  # without its share, the same motion is a contact
    rig.body.release()
    assert rig.settle() is Phase.STOPPED
    rig.close()
