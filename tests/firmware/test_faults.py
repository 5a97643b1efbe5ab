"""Whatever fails, the robot ends at rest, and the host is told in words."""

import struct
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.firmware.rig import LOAD, NO_LOADS, Rig, calibrated

from miburi.bodies import Motor
from miburi.card.card import Card
from miburi.card.link import FrameKind
from miburi.card.settings import ALLOWED, CardSettings, JointSettings
from miburi.emulation.control_table import REGISTERS
from miburi.emulation.servos import Servo
from miburi.errors import BodyError
from miburi.robot import JOINTS
from miburi.robot.guards import GUARDS, Guards
from miburi.safety.move import Move
from miburi.safety.stop import Phase, StopReason


def raise_arms(rig: Rig, speed: float = 1.0) -> None:
    """Start a move of a second or more, and let half of it pass."""
    angles = rig.robot.neutral.copy()
    angles[[1, 4]] += 1.2
    rig.body.move(Move(angles, np.full(8, speed)))
    rig.run(0.5)
    assert rig.body.state.phase is Phase.MOVING


def symbol(firmware: Path, name: str) -> int:
    said = subprocess.run(
        ["avr-nm", firmware / "miburi.elf"], capture_output=True, check=False, text=True
    )
    return next(
        int(line.split()[0], 16) for line in said.stdout.splitlines() if line.split()[-1] == name
    )


def stays_stopped(rig: Rig, seconds: float = 1.0) -> None:
    assert rig.at_rest()
    rig.run(seconds)
    assert rig.body.state.phase is Phase.STOPPED
    with pytest.raises(BodyError, match="stopped"):
        rig.body.move(Move(rig.robot.neutral, np.ones(8)))


def recovers(rig: Rig) -> None:
    """Only a release brings it back, to neutral."""
    rig.body.wake()
    assert np.abs(rig.body.state.angles - rig.robot.neutral).max() < 0.01
    raise_arms(rig)
    assert rig.settle() is Phase.IDLE


def test_power_on_moves_nothing(firmware: Path) -> None:
    rig = Rig(firmware, wake=False, twin=False)
    for servo in rig.servos:
        servo.set("goal_position", 0)  # a trap: torque on would pull there at once
    before = [servo.shaft.place for servo in rig.servos]
    rig.run(1.0)
    state = rig.body.state
    assert (state.phase, state.stop.reason) == (Phase.STOPPED, StopReason.CARD_STARTED)
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


def test_a_card_tells_how_its_servos_are_until_it_is_lost(firmware: Path) -> None:
    rig = Rig(firmware, wake=False, twin=False)
    assert rig.body.touchable is None
    assert rig.body.motors().rule.period == rig.settings.general.period
    # It looks at their health every half second; until then that is not known.
    assert rig.body.motors().each == tuple(Motor(i + 1, True) for i in range(8))
    rig.servos[4].dead = True
    rig.run(1.0)
    told = rig.body.motors()
    assert (told.hottest, told.lowest) == (65, 4.2)
    assert told.settings == f"{rig.settings.crc:04x}"
    assert [motor.answers for motor in told.each] == [i != 4 for i in range(8)]
    assert told.each[0] == Motor(1, True, 35, 5.0)
    rig.line.pulled = True
    rig.run(3.0)
    assert rig.body.motors().each == tuple(Motor(i + 1, False) for i in range(8))
    rig.close()


def test_pulled_cable_is_a_stop_until_released(rig: Rig) -> None:
    raise_arms(rig)
    rig.line.pulled = True
    rig.run(3.0)
    state = rig.body.state
    assert (state.phase, state.stop.reason) == (Phase.STOPPED, StopReason.LINE_LOST)
    assert rig.at_rest()
    with pytest.raises(BodyError, match="cable|line"):
        rig.body.release()
    rig.line.pulled = False
    rig.run(3.0)
    stays_stopped(rig)
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
    rig.run(4.0)
    state = rig.body.state
    assert (state.phase, state.stop.reason) == (Phase.STOPPED, StopReason.CARD_STARTED)
    stays_stopped(rig)
    recovers(rig)


@pytest.mark.parametrize("saved", [True, False])
def test_card_reset_in_mid_move_ends_at_rest(rig: Rig, saved: bool) -> None:
    if saved:
        rig.body.stop()
        rig.body.save()
        rig.body.wake()
    raise_arms(rig, speed=0.8)
    rig.line.mega.reset()
    rig.line.run(rig.line.mega.time + 300_000)
    assert rig.at_rest()
    assert abs(rig.servos[1].shaft.place - rig.servos[1].get("goal_position")) < 60 or not saved
    rig.run(4.0)
    state = rig.body.state
    assert (state.phase, state.stop.reason) == (Phase.STOPPED, StopReason.CARD_STARTED)
    stays_stopped(rig)
    recovers(rig)


@pytest.mark.parametrize("motor", range(8))
def test_unplugged_servo_stops_all_and_is_named(rig: Rig, motor: int) -> None:
    raise_arms(rig)
    rig.servos[motor].dead = True
    rig.run(0.3)
    stop = rig.body.state.stop
    assert (stop.reason, stop.motor) == (StopReason.SERVO_SILENT, JOINTS[motor])
    others = [servo for servo in rig.servos if not servo.dead]
    assert all(servo.segment.acceleration == 0 for servo in others)
    with pytest.raises(BodyError, match=f"{JOINTS[motor]}: servo does not answer"):
        rig.body.release()
    rig.servos[motor].dead = False
    rig.servos[motor].power_up()
    rig.run(0.3)
    recovers(rig)


@pytest.mark.parametrize(
    ("entry", "value", "reason", "said"),
    [
        ("temperature", 65, StopReason.SERVO_HOT, "servo is too hot; let it cool"),
        ("voltage", 41, StopReason.LOW_VOLTAGE, "supply voltage is too low; use a stronger"),
    ],
)
def test_unfit_servo_stops_all_and_is_named(
    rig: Rig, entry: str, value: int, reason: StopReason, said: str
) -> None:
    raise_arms(rig, speed=0.8)
    fit = rig.servos[5].get(entry)
    rig.servos[5].set(entry, value)
    rig.run(0.7)
    stop = rig.body.state.stop
    assert (stop.reason, stop.motor) == (reason, JOINTS[5])
    stays_stopped(rig)
    with pytest.raises(BodyError, match=f"{JOINTS[5]}: {said}"):
        rig.body.release()
    rig.servos[5].set(entry, fit)
    recovers(rig)


def test_faulty_servo_is_restarted_by_a_release(rig: Rig) -> None:
    raise_arms(rig)
    rig.servos[2].fail(4)
    rig.run(0.2)
    stop = rig.body.state.stop
    assert (stop.reason, stop.motor) == (StopReason.SERVO_FAULTY, JOINTS[2])
    with pytest.raises(BodyError, match="hardware error"):
        rig.body.release()
    recovers(rig)


def test_deaf_servo_is_named(rig: Rig) -> None:
    rig.servos[4].deaf = True
    angles = rig.robot.neutral.copy()
    angles[[1, 4]] += 1.0
    rig.body.move(Move(angles, np.ones(8)))
    rig.run(0.1)
    stop = rig.body.state.stop
    assert (stop.reason, stop.motor) == (StopReason.SERVO_DEAF, JOINTS[4])
    assert rig.at_rest()
    with pytest.raises(BodyError, match="does not take orders"):
        rig.body.release()
    rig.servos[4].deaf = False
    recovers(rig)


def test_who_loses_the_cards_gains_is_named_and_gets_them_back(rig: Rig) -> None:
    general, servo = rig.settings.general, rig.servos[3]
    gains = ("position_d_gain", "position_i_gain", "position_p_gain")
    gains += ("feedforward_2nd_gain", "feedforward_1st_gain")
    ours = [general.d_gain, 0, general.p_gain, 0, 0]
    assert [[one.get(name) for name in gains] for one in rig.servos] == [ours] * 8
    for name, other in zip(gains, (10, 20, 400, 30, 40), strict=True):
        servo.set(name, other)
        rig.run(0.3)
        stop = rig.body.state.stop
        assert stop is not None, name
        assert (stop.reason, stop.motor) == (StopReason.SERVO_RESTARTED, JOINTS[3])
        rig.body.wake()
        assert [servo.get(name) for name in gains] == ours


def test_a_servo_that_takes_no_gains_is_refused(rig: Rig) -> None:
    rig.body.stop()
    servo, write = rig.servos[6], rig.servos[6].write
    servo.set("position_p_gain", 400)

    def but_gains(address: int, data: bytes, time: float) -> int:
        return 0 if address == 80 else write(address, data, time)

    servo.write = but_gains  # type: ignore[method-assign]
    with pytest.raises(BodyError, match=f"{JOINTS[6]}: servo does not take orders"):
        rig.body.wake()
    servo.write = write  # type: ignore[method-assign]
    recovers(rig)


def test_only_what_the_manual_defines_is_read(rig: Rig) -> None:
    """What a servo says of the addresses between its registers, the manual leaves open."""
    defined = {
        at
        for register in REGISTERS.values()
        for at in range(register.address, register.address + register.size)
    }
    asked = set[int]()
    for servo in rig.servos:

        def read(address: int, count: int, time: float, one: Servo = servo) -> tuple[int, bytes]:
            asked.update(range(address, address + count))
            return Servo.read(one, address, count, time)

        servo.read = read  # type: ignore[method-assign]
    rig.body.stop()
    rig.body.wake()
    raise_arms(rig)
    assert rig.settle() is Phase.IDLE
    rig.run(0.6)  # it looks at health and gains meanwhile
    assert asked >= {80, 85, 88, 91, 146}
    assert asked <= defined, sorted(asked - defined)


@pytest.mark.parametrize("startup", [1, 2, 3])
def test_a_servo_never_gets_torque_back_by_itself(rig: Rig, startup: int) -> None:
    """Its Startup Configuration may bring torque and, from a backup, another goal."""
    rig.body.stop()
    rig.servos[5].set("startup", startup)
    rig.body.wake()
    assert [servo.get("startup") for servo in rig.servos] == [0] * 8
    rig.servos[5].power_up()
    assert rig.servos[5].get("torque_enable") == 0


def test_a_servo_whose_firmware_has_no_startup_configuration_is_taken(rig: Rig) -> None:
    """Register 60 came with firmware 46."""
    rig.body.stop()
    servo = rig.servos[5]

    def read(address: int, count: int, time: float) -> tuple[int, bytes]:
        return (7, b"") if address == 60 else Servo.read(servo, address, count, time)

    servo.read = read  # type: ignore[method-assign]
    recovers(rig)


def test_no_move_without_its_loads_nor_with_more_than_a_motor_holds(rig: Rig) -> None:
    here = struct.pack("<8h8H", *[joint.neutral for joint in rig.settings.joints], *[100] * 8)
    for _ in range(2):
        with pytest.raises(BodyError, match="not told the loads"):
            rig.body.ask(FrameKind.MOVE, here)
        rig.body.ask(FrameKind.LOADS, NO_LOADS)
        rig.body.ask(FrameKind.MOVE, here)  # it takes the loads: the next needs its own
        rig.run(0.1)
        assert rig.settle() is Phase.IDLE
    held = rig.settings.general.error_per_pwm * 60 // 256 // 64  # quarters of a step
    for load in ((held + 1, 0, 60), (0, -held - 1, 60), (0, 0, 0), (0, 0, 886)):
        wrong = LOAD.pack(0, 0, 885) * 4 + LOAD.pack(*load) + LOAD.pack(0, 0, 885) * 3
        with pytest.raises(BodyError, match=f"load of {JOINTS[4]}: it is more"):
            rig.body.ask(FrameKind.LOADS, wrong)
    assert rig.body.state.phase is Phase.IDLE
    rig.body.stop()
    with pytest.raises(BodyError, match="not told the loads"):
        rig.body.ask(FrameKind.RELEASE)


def test_answers_that_are_lost_in_turn_do_not_starve_the_rule(rig: Rig) -> None:
    """Each servo is heard often enough, but never all at once: the rule would not look."""
    raise_arms(rig, speed=0.8)
    readings = 0
    missing = [rig.servos[motor].get("id") for motor in (2, 5)]

    def lose(data: bytes) -> bytes:
        nonlocal readings
        readings += data[7:9] == b"\x82\x80"  # a sync read from address 128
        return b"" if data[7] == 0x55 and data[4] == missing[readings % 2] else data

    rig.bus.spoil = lose
    rig.run(0.2)
    rig.bus.spoil = lambda data: data
    stop = rig.body.state.stop
    assert stop is not None
    assert stop.reason == StopReason.SERVO_SILENT
    assert stop.motor in (JOINTS[2], JOINTS[5])
    rig.run(0.3)
    stays_stopped(rig)
    recovers(rig)


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
        rig.body.wake()
    raise_arms(rig)


def test_slow_answers_are_waited_for(rig: Rig) -> None:
    for servo in rig.servos:
        servo.delay = 800.0
    raise_arms(rig)
    assert rig.settle() is Phase.IDLE


def test_clock_that_wraps_in_mid_move_is_not_noticed(rig: Rig, firmware: Path) -> None:
    """After 71 minutes micros() begins anew: here in the middle of a move."""
    overflows = symbol(firmware, "timer0_overflow_count") & 0xFFFF  # in data memory
    before = rig.body.report.time
    # A tick of timer 0 is 4 µs and it overflows after 256: 300 ms before the wrap.
    rig.line.mega.poke(overflows, struct.pack("<I", (1 << 22) - 293))
    rig.run(0.1)
    raise_arms(rig)
    assert rig.settle() is Phase.IDLE
    assert rig.body.report.time > before


def test_a_tap_on_stop_holds_softly(rig: Rig) -> None:
    raise_arms(rig)
    rig.body.stop()
    assert rig.body.state.stop.reason == StopReason.ASKED
    assert {servo.get("goal_pwm") for servo in rig.servos} == {222}
    assert rig.at_rest()
    recovers(rig)
    order = rig.body.order
    assert order is not None
    assert [servo.get("goal_pwm") for servo in rig.servos] == order.pwm.tolist()


def test_a_stop_under_load_lets_nothing_sink_and_its_end_is_no_contact(rig: Rig) -> None:
    loads = (0, 12, 8, 4, -12, -8, -4, 12)
    for servo, load in zip(rig.servos, loads, strict=True):
        servo.shaft.load = float(load)
    rig.body.hung = tuple(-load for load in loads)
    rig.run(0.2)
    raise_arms(rig)
    rig.run(0.3)
    rig.body.stop()
    rig.run(0.2)
    where = rig.body.report.positions
    rig.run(1.0)
    assert np.abs(np.subtract(rig.body.report.positions, where)).max() <= 1
    assert {servo.get("goal_pwm") for servo in rig.servos} == {222}
    rig.body.wake()
    assert rig.body.state.phase is Phase.IDLE


def test_a_soft_servo_hangs_by_more_than_the_host_says(firmware: Path) -> None:
    """Its share of the sag is the card's: three times what the description's servo would hang."""
    told = (0, 12, 10, -8, -12, -10, 8, 12)
    settings = calibrated(firmware)
    soft = replace(settings, joints=tuple(replace(joint, sag=768) for joint in settings.joints))
    rig = Rig(firmware, wake=False, settings=soft)
    rig.body.hung = told
    for servo, sag in zip(rig.servos, told, strict=True):
        servo.shaft.load = -3.0 * sag
    rig.body.step(0.04)
    rig.body.wake()
    raise_arms(rig)
    assert rig.settle() is Phase.IDLE, rig.body.state.stop
    assert rig.twin.looks > 30
    rig.body.stop()
    rig.body.configure(settings)  # without its share, the same motion is a contact
    rig.body.release()
    assert rig.settle() is Phase.STOPPED
    rig.close()


def test_limits_and_caps_stand_on_the_card_itself(rig: Rig) -> None:
    """Past the host's own checks: the card refuses by itself, and nothing moves."""
    joints, general = rig.settings.joints, rig.settings.general
    here = [joint.neutral for joint in joints]
    before = rig.bus.instructions

    def ask(goals: list[int], speeds: list[int]) -> str:
        rig.body.ask(FrameKind.LOADS, NO_LOADS)
        with pytest.raises(BodyError) as refused:
            rig.body.ask(FrameKind.MOVE, struct.pack("<8h8H", *goals, *speeds))
        return str(refused.value)

    for i, joint in enumerate(joints):
        for goal in (joint.min - 1, joint.max + 1, -32768, 32767):
            goals = here.copy()
            goals[i] = goal
            assert f"goal of {JOINTS[i]}" in ask(goals, [100] * 8)
        speeds = [100] * 8
        speeds[i] = general.max_speed + 1
        assert f"speed of {JOINTS[i]}" in ask(here, speeds)
    assert rig.body.state.phase is Phase.IDLE
    assert rig.bus.instructions > before
    assert rig.at_rest()
    for end in (rig.robot.lower, rig.robot.upper):
        rig.body.move(Move(end, np.full(8, rig.robot.servo.max_speed)))
        assert rig.settle() is Phase.IDLE
        np.testing.assert_allclose(rig.body.state.angles, end, atol=2e-3)


def changed(joint: JointSettings, name: str, value: int) -> JointSettings:
    if name in GUARDS:
        return replace(joint, guards=replace(joint.guards, **{name: value}))
    return replace(joint, **{name: value})


def test_settings_stay_inside_safe_ranges_and_change_only_while_stopped(rig: Rig) -> None:
    settings = rig.settings
    with pytest.raises(BodyError, match="idle"):
        rig.body.configure(settings)
    rig.body.stop()
    for name in vars(settings.general):
        low, high = ALLOWED[name][:2]
        for value in (low - 1, high + 1) if low else (high + 1,):
            wrong = replace(settings, general=replace(settings.general, **{name: value}))
            said = f"refuses {name} .*: allowed is "
            with pytest.raises(BodyError, match=said):
                rig.body.configure(wrong)
    joint = settings.joints[0]
    beyond = {name: (ALLOWED[name][0] - 1, ALLOWED[name][1] + 1) for name in GUARDS}
    beyond |= {"servo": (253,), "direction": (0, 2, -2), "zero": (4096, 0)}
    beyond |= {"neutral": (-3000, 3000), "min": (3000, -4096), "max": (-3000, 4096)}
    for name, values in beyond.items():
        for value in values:
            joints = (changed(joint, name, value), *settings.joints[1:])
            seam = name in ("min", "max") or (name, value) == ("zero", 0)
            said = (
                "steps of the servo's seam" if seam else f"refuses waist's {name} .*: allowed is "
            )
            with pytest.raises(BodyError, match=said):
                rig.body.configure(replace(settings, joints=joints))
    # What is just allowed is taken: the ranges in words are the card's.
    for end in (0, 1):
        guards = Guards(*(ALLOWED[name][end] for name in GUARDS))
        joints = tuple(replace(j, guards=guards) for j in settings.joints)
        general = type(settings.general)(*(ALLOWED[name][end] for name in vars(settings.general)))
        rig.body.configure(CardSettings(general, joints))
    twice = (replace(settings.joints[0], servo=2), *settings.joints[1:])
    rig.body.configure(settings)
    with pytest.raises(BodyError):
        rig.body.configure(replace(settings, joints=twice))
        rig.body.wake()
    rig.body.configure(settings)
    recovers(rig)


def test_settings_outlast_a_loss_of_power_and_a_blank_or_torn_eeprom_is_no_setting(
    rig: Rig, firmware: Path
) -> None:
    rig.body.stop()
    rig.body.save()
    kept = rig.line.mega.eeprom
    for damage, complete in ((None, True), (0, False), (100, False), (195, False)):
        torn = bytearray(kept)
        if damage is not None:
            torn[damage] ^= 1
        rig.line.mega.eeprom = bytes(torn)
        rig.line.mega.reset()
        rig.line.run(rig.line.mega.time + 100_000)
        crc, has_all, stored = rig.body.hello()
        assert has_all == complete
        if complete:
            assert crc == rig.settings.crc
            assert stored


def test_a_repeated_frame_is_obeyed_once(rig: Rig) -> None:
    joints = rig.settings.joints
    goal = struct.pack("<8h8H", *[j.neutral + 200 for j in joints], *[2000] * 8)
    back = struct.pack("<8h8H", *[j.neutral for j in joints], *[2000] * 8)
    rig.body.ask(FrameKind.LOADS, NO_LOADS)
    rig.body.ask(FrameKind.MOVE, goal)
    rig.run(0.1)
    assert rig.settle() is Phase.IDLE
    rig.body.ask(FrameKind.LOADS, NO_LOADS)
    rig.body.ask(FrameKind.MOVE, back)
    rig.run(0.1)
    assert rig.settle() is Phase.IDLE
    rig.line.write(rig.line.sent)
    rig.run(0.1)
    assert rig.body.state.phase is Phase.IDLE


@pytest.mark.parametrize(("number", "baud"), [(1, 1), (7, 1), (1, 3), (7, 3)])
@pytest.mark.parametrize("late", [0.0, 20_000.0])
def test_identify_gives_a_new_servo_its_id(
    firmware: Path, number: int, baud: int, late: float
) -> None:
    """As from the factory, or half-done: with the new id or speed already; however late it is."""
    rig = Rig(firmware, wake=False, twin=False)
    fresh = Servo.new(number)
    fresh.set("baud", baud)
    fresh.delay = late
    rig.bus.servos[:] = [fresh]
    rig.body.identify(1, 7)
    assert (fresh.get("id"), fresh.get("baud"), fresh.get("operating_mode")) == (7, 3, 3)
    before = rig.body.report.time
    with pytest.raises(BodyError, match="servo does not answer"):
        rig.body.identify(3, 4)
    rig.run(0.1)
    assert rig.body.report.time > before  # so long a wait did not wake the watchdog
    rig.close()


def test_settings_of_another_layout_are_noticed(rig: Rig) -> None:
    rig.body.stop()
    rig.body.save()
    other = bytearray(rig.line.mega.eeprom)
    other[1] += 1
    rig.line.mega.eeprom = bytes(other)
    rig.line.mega.reset()
    again = Card(lambda: rig.line, rig.robot)
    with pytest.raises(BodyError, match=r"another version of the firmware.* card load"):
        again.wake()
    again.configure(rig.settings)  # as `miburi card load` and `calibrate` do
    again.wake()
