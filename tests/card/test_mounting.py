"""Servos that were put in wrongly are found before anything moves."""

import numpy as np
import pytest

from miburi.card.mounting import Turned, mounting_faults
from miburi.hardware.places import mounting
from miburi.robot import JOINTS, buildable

BUILT = mounting(buildable())
#: By how far a hand misses a joint's zero, in encoder steps: 10°.
MISSED = 114


def turn_all(
    order: list[int], signs: list[int], offsets: list[int], missed: int = 0
) -> list[Turned]:
    """What servos say: ``order`` names the servo that each joint moves, all as they sit."""
    turns = []
    places = np.array(BUILT.zero) + 40
    for motor in range(8):
        servo = order[motor]
        zero = BUILT.zero[servo] + offsets[motor] + missed
        before = places.copy()
        before[servo] = zero
        after = before.copy()
        after[servo] += signs[motor] * BUILT.direction[motor] * 114
        turns.append(Turned(motor, before % 4096, after % 4096))
    return turns


RIGHT = (list(range(8)), [1] * 8, [0] * 8)


@pytest.mark.parametrize("missed", [-MISSED, 0, MISSED])
def test_a_robot_that_is_put_together_well_has_no_fault(missed: int) -> None:
    assert mounting_faults(BUILT, turn_all(*RIGHT, missed)) == []


@pytest.mark.parametrize("motor", range(8), ids=JOINTS)
@pytest.mark.parametrize("kind", ["swapped", "reversed", "quarter", "half", "limp"])
def test_each_fault_of_each_servo_is_named(motor: int, kind: str) -> None:
    order, signs, offsets = (list(values) for values in RIGHT)
    other = (motor + 3) % 8
    match kind:
        case "swapped":
            order[motor], order[other] = other, motor
        case "reversed":
            signs[motor] = -1
        case "quarter":
            offsets[motor] = 1024
        case "half":
            offsets[motor] = -2048
        case "limp":
            signs[motor] = 0
    for missed in (-MISSED, 0):
        assert len(mounting_faults(BUILT, turn_all(order, signs, offsets, missed))) in {1, 2}
    lines = mounting_faults(BUILT, turn_all(order, signs, offsets, MISSED))
    wrong = {motor, other} if kind == "swapped" else {motor}
    assert [line.partition(":")[0] for line in lines] == [
        JOINTS[one].replace("_", " ") for one in sorted(wrong)
    ]
    words = {
        "swapped": "swapped", "reversed": "turned the other way", "quarter": "sits 90° off",
        "half": "sits 180° off", "limp": "no servo turned",
    }  # fmt: skip
    assert all(words[kind] in line for line in lines), lines


def test_a_joint_that_is_far_from_its_zero_is_no_horn_that_is_off() -> None:
    offsets = [0] * 8
    offsets[2] = 400
    (line,) = mounting_faults(BUILT, turn_all(RIGHT[0], RIGHT[1], offsets))
    assert "35° from where" in line


def test_a_head_that_sags_meanwhile_is_not_what_was_turned() -> None:
    turns = turn_all(*RIGHT)
    turns[0].after[7] -= 400
    assert mounting_faults(BUILT, turns) == []


def test_counts_that_pass_their_end_are_no_turn() -> None:
    """One servo rests where it counts 4095 and 0 in turn."""
    turns = turn_all(*RIGHT)
    for number, turned in enumerate(turns):
        if number != 7:
            turned.before[7], turned.after[7] = 4095, 0
    assert mounting_faults(BUILT, turns) == []
