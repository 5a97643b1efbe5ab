"""A servo that says what cannot be is named, and no arm is thrown: on the real binary."""

import os
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from pathlib import Path

import pytest
from tests.firmware.orders import Orders, begin
from tests.firmware.rig import Rig

from miburi.card.card import wake
from miburi.card.settings import SEAM
from miburi.errors import BodyError
from miburi.robot import JOINTS
from miburi.safety.stop import Phase, StopReason

TURN = 4096
#: Every lie of every motor in every phase, as `make firmware-proof` asks; otherwise one of the
#: seven each, so that every lie meets every phase by one motor or two.
ALL = "MIBURI_LIES" in os.environ


def lies(rig: Rig, motor: int) -> dict[str, Callable[[int], int]]:
    other = rig.servos[(motor + 3) % 8]
    frozen = round(rig.servos[motor].shaft.place)
    return {
        "0": lambda _: 0,
        "largest": lambda _: 2**31 - 1,
        "smallest": lambda _: -(2**31),
        "a turn more": lambda place: place + TURN,
        "a turn less": lambda place: place - TURN,
        "another's": lambda _: round(other.shaft.place),
        "frozen": lambda _: frozen,
    }


#: With the others, every lie meets every phase.
OTHERS = [
    pytest.param(motor, marks=pytest.mark.proof("test_a_lying_reading_throws_no_arm_and_is_named"))
    for motor in range(8)
    if motor not in (0, 3)
]


@pytest.mark.parametrize("motor", [0, 3, *OTHERS])
def test_a_lying_reading_throws_no_arm_and_is_named(firmware: Path, motor: int) -> None:
    """Kinds of lies, at every phase."""
    rig = Rig(firmware, twin=False)
    orders = Orders(rig)
    for number, phase in enumerate((Phase.IDLE, Phase.MOVING, Phase.STOPPED, Phase.RETURNING)):
        kinds = list(lies(rig, motor))
        for kind in kinds if ALL else [kinds[(motor + number) % 7]]:
            begin(rig, phase, motor)
            assert rig.body.state.phase is phase
            servo, tale = rig.servos[motor], lies(rig, motor)[kind]
            servo.lie = tale
            far = abs(tale(round(servo.shaft.place)) - servo.shaft.place) > 500
            rig.run(0.3 if far or phase is Phase.IDLE else 1.5)
            state, what = rig.body.state, f"{kind}, {phase}"
            if far:
                assert state.phase is Phase.STOPPED, what
            if far and phase is not Phase.STOPPED:
                assert state.stop.reason is StopReason.SERVO_ASTRAY, what
                assert state.stop.motor == JOINTS[motor], what
            if phase is Phase.STOPPED and far and kind != "another's":
                with pytest.raises(BodyError, match=JOINTS[motor]):
                    rig.body.release()
            assert rig.settle() in (Phase.IDLE, Phase.STOPPED)
            assert rig.at_rest(), what
            servo.lie = lambda place: place
            rig.run(0.2)
            assert not orders.wrong, (what, orders.wrong)
            if rig.body.state.phase is Phase.STOPPED:
                wake(rig.body)
            elif phase is not Phase.IDLE:
                rig.body.stop()
                wake(rig.body)
    rig.close()


@pytest.mark.parametrize("phase", [Phase.IDLE, Phase.MOVING])
def test_one_reading_that_cannot_be_is_passed_over(rig: Rig, phase: Phase) -> None:
    begin(rig, phase, 1)
    told = iter([5000])
    rig.servos[1].lie = lambda place: next(told, place)
    rig.run(0.2)
    assert next(told, None) is None
    assert rig.settle() is Phase.IDLE


def test_a_limp_joint_that_is_turned_by_hand_is_believed(rig: Rig) -> None:
    rig.body.stop()
    rig.body.relax()
    rig.run(0.1)
    rig.servos[0].shaft.place += 300
    rig.run(0.2)
    neutral = rig.settings.joints[0].neutral
    assert abs(rig.body.report.positions[0] - neutral) > 290
    wake(rig.body)


@pytest.mark.parametrize("size", [317, -1000])
@pytest.mark.parametrize("phase", [Phase.STOPPED, Phase.IDLE])
def test_a_held_joint_that_jumped_is_astray_until_it_is_limp(
    rig: Rig, phase: Phase, size: int
) -> None:
    """However long it says so; whoever lets it go limp is believed to have turned it."""
    orders = Orders(rig)
    begin(rig, phase, 0)
    rig.servos[0].lie = lambda place: place + size
    rig.run(0.5)
    for _ in range(3):
        with pytest.raises(BodyError, match=f"{JOINTS[0]}: .* impossible position"):
            rig.body.release()
    assert not orders.wrong
    rig.servos[0].lie = lambda place: place
    if size > 0:
        rig.body.relax()
    else:  # it was switched off and on
        rig.servos[0].power_up()
    rig.run(0.1)
    rig.servos[0].shaft.place += size / 4
    rig.run(0.1)
    wake(rig.body)


@pytest.mark.parametrize("alias", [1, 8])
def test_a_servo_that_answers_with_anothers_id_is_named(rig: Rig, alias: int) -> None:
    orders = Orders(rig)
    begin(rig, Phase.MOVING, 3)
    rig.servos[3].alias = alias
    rig.run(0.3)
    assert rig.cause == (StopReason.SERVO_MISNAMED, JOINTS[3])
    assert not orders.wrong
    with pytest.raises(BodyError, match=f"{JOINTS[3]}: servo "):
        rig.body.release()
    rig.servos[3].alias = None
    rig.run(0.2)
    wake(rig.body)


@pytest.mark.parametrize("phase", [Phase.IDLE, Phase.MOVING])
def test_a_servo_that_restarted_within_a_moment_is_named(rig: Rig, phase: Phase) -> None:
    """At rest nothing but its torque tells, as after a move that is too short for the rule."""
    begin(rig, phase, 4)
    rig.servos[7].power_up()
    rig.run(0.3 if phase is Phase.IDLE else 2.0)
    assert rig.cause == (StopReason.SERVO_RESTARTED, JOINTS[7])
    wake(rig.body)
    assert rig.servos[7].get("torque_enable") == 1


@pytest.mark.parametrize(("beyond", "sign"), [(100, 1), (100, -1), (400, 1)])
def test_a_joint_outside_its_limits_is_refused_with_its_angle(
    rig: Rig, beyond: int, sign: int
) -> None:
    joint, servo = rig.settings.joints[2], rig.servos[2]
    rig.body.stop()
    rig.body.relax()
    end = joint.max if sign > 0 else joint.min
    outside = end + sign * beyond
    servo.shaft.place = joint.zero + joint.direction * outside
    rig.run(0.2)
    angle = outside * 360 / TURN
    with pytest.raises(BodyError, match=rf"right_elbow stands at {angle:.1f}°, outside .* by hand"):
        rig.body.release()
    assert servo.get("torque_enable") == 0
    servo.shaft.place = joint.zero + joint.direction * (end + sign * 6)  # it lies a little beyond
    rig.run(0.2)
    wake(rig.body)


def test_a_joint_across_the_servos_seam_is_not_turned_the_long_way(rig: Rig) -> None:
    """Beyond a limit that is near the seam, a servo that starts counts from the other side."""
    joint, servo = rig.settings.joints[2], rig.servos[2]
    rig.body.stop()
    rig.body.relax()
    near = TURN - 1 - SEAM - joint.direction * joint.max
    joints = list(rig.settings.joints)
    joints[2] = replace(joint, zero=near)
    rig.body.configure(replace(rig.settings, joints=tuple(joints)))
    servo.shaft.place = near + joint.direction * joint.max + 112 - TURN
    rig.run(0.2)
    before = servo.shaft.place
    assert before < 20
    angle = (joint.max + 112) * 360 / TURN
    with pytest.raises(BodyError, match=rf"right_elbow stands at {angle:.1f}°"):
        wake(rig.body)
    assert servo.shaft.place == before


@pytest.mark.parametrize("end", ["min", "max"])
def test_no_range_comes_near_the_servos_seam(rig: Rig, end: str) -> None:
    joint = rig.settings.joints[2]
    last = SEAM - joint.min if end == "min" else TURN - 1 - SEAM - joint.max
    beyond = -1 if end == "min" else 1
    rig.body.stop()
    for zero in (last, last + beyond):
        joints = list(rig.settings.joints)
        joints[2] = replace(joint, zero=zero)
        settings = replace(rig.settings, joints=tuple(joints))
        if zero == last:
            rig.body.configure(settings)
        else:
            with pytest.raises(BodyError, match="right_elbow: .* seam .* within 100 steps"):
                rig.body.configure(settings)


@pytest.mark.parametrize("motor", [0, 4])
def test_a_reading_that_was_off_as_a_release_began_does_not_bar_the_next_ones(
    firmware: Path, motor: int
) -> None:
    """The error was kept as a load; each release moved the joint by it, and stopped."""
    rig = Rig(firmware, twin=False)
    begin(rig, Phase.STOPPED, motor)
    rig.line.run(rig.line.mega.time + 6800)
    readings = count()
    rig.servos[motor].lie = lambda place: place - 16 * (next(readings) % 2 == 0)
    rig.body.release()
    assert rig.settle() is Phase.STOPPED
    rig.servos[motor].lie = lambda place: place
    rig.run(0.3)
    wake(rig.body)
    rig.close()
