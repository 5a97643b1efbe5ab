"""Moves that begin before the last has ended: the real binary goes on, and forgets nothing."""

import os
from pathlib import Path

import numpy as np
import pytest
from tests.firmware.rig import Rig
from tests.firmware.test_lost_bytes import Damage, is_order
from tests.firmware.toolchain import changed_card

from miburi.errors import BodyError
from miburi.robot import JOINTS, iphonoid
from miburi.safety.move import Move, plan_move, plan_on
from miburi.safety.stop import Phase, StopReason

#: `make firmware-proof` asks for more.
FREE = int(os.environ.get("MIBURI_MOVES", "16,0").split(",")[0])
WORKERS = 2


def go_on(rig: Rig, rng: np.random.Generator) -> Move:
    """Send a move from within another, to anywhere or at any speeds."""
    robot, seconds = rig.robot, float(rng.uniform(0.3, 1.5))
    angles = rng.uniform(robot.lower, robot.upper)
    move = plan_on(robot, rig.body.course(), angles, seconds)
    if rng.random() < 0.3:
        speeds = np.exp(rng.uniform(np.log(0.5), np.log(robot.servo.max_speed), 8))
        move = Move(angles, speeds, 0.5, 1.0)
    rig.body.move(move)
    return move


@pytest.mark.parametrize("seed", range(WORKERS))
def test_free_moves_that_replace_one_another_are_never_stopped(firmware: Path, seed: int) -> None:
    rig, rng = Rig(firmware, 40 + seed), np.random.default_rng(seed)
    rig.shake()
    for _ in range(FREE // WORKERS):
        move = go_on(rig, rng)
        rig.run(float(rng.choice([move.slows_at, rng.uniform(0.05, 1.0)])))
        assert rig.body.state.phase in (Phase.MOVING, Phase.IDLE), rig.body.state.stop
    assert rig.settle() is Phase.IDLE, rig.body.state.stop
    # Wherever they were sent on the way, they come to where they were sent last.
    assert np.abs(rig.body.state.angles - move.angles).max() < 0.03
    assert rig.twin.looks > 5 * FREE // WORKERS
    rig.close()


@pytest.mark.parametrize("motor", range(0, 8, 3))
def test_a_blocked_motor_stops_all_also_if_moves_replace_one_another(
    firmware: Path, motor: int
) -> None:
    """The card stops at the reading at which its twin in Python does, for the same reason."""
    rig, rng = Rig(firmware, 60 + motor), np.random.default_rng(motor)
    for _ in range(3):
        go_on(rig, rng)
        rig.run(0.2)
    shaft, place = rig.servos[motor].shaft, rig.servos[motor].shaft.place
    shaft.low, shaft.high = place - 1, place + 1
    for _ in range(20):
        if rig.body.state.phase is Phase.STOPPED:
            break
        try:
            go_on(rig, rng)
        except BodyError:
            break
        rig.run(0.15)
    assert rig.cause == (StopReason.CONTACT, JOINTS[motor])
    rig.close()


def test_no_number_of_moves_makes_the_rule_forget_a_hand(firmware: Path) -> None:
    """Moves come faster than a window lasts; each time the motor is where its reading says."""
    rig = Rig(firmware, 70)
    robot, there = rig.robot, np.array(rig.robot.neutral)
    there[1] += 1.2
    rig.body.move(plan_move(robot, robot.neutral, there, 6.0))
    rig.run(0.5)
    shaft = rig.servos[1].shaft
    shaft.low, shaft.high = shaft.place - 1, shaft.place + 1
    held = rig.line.now()
    with pytest.raises(BodyError, match="stopped"):
        for _ in range(100):
            rig.body.move(plan_on(robot, rig.body.course(), there, 6.0))
            rig.run(0.04)
    assert rig.cause == (StopReason.CONTACT, JOINTS[1])
    assert rig.line.now() - held < 0.5
    rig.close()


@pytest.mark.parametrize("numbers", [(0,), (0, 1)])
def test_an_order_that_is_damaged_within_a_move_is_no_contact(
    firmware: Path, numbers: tuple[int, ...]
) -> None:
    """Motors go on with the old move until they hear of the new one."""
    rig, robot = Rig(firmware, 72, twin=False), iphonoid()
    there = rig.robot.neutral.copy()
    there[[0, 1, 4]] += 0.6, 1.0, 1.0
    ends = (there, robot.neutral)
    for index in range(6):
        damage = Damage(rig, is_order, numbers)
        course = rig.body.course()
        rig.body.move(plan_on(rig.robot, course, ends[index % 2], (0.5, 0.7, 1.0)[index % 3]))
        assert damage.done == len(numbers), damage.seen
        rig.run(0.25)
        assert rig.body.state.phase is Phase.MOVING, rig.body.state.stop
    assert rig.settle() is Phase.IDLE, rig.body.state.stop
    rig.close()


def test_no_move_cuts_the_way_back_short(firmware: Path) -> None:
    rig = Rig(firmware, 71)
    rig.body.move(plan_move(rig.robot, rig.robot.neutral, rig.robot.upper, 1.0))
    rig.run(0.4)
    rig.body.stop()
    rig.run(0.5)
    with pytest.raises(BodyError, match="stopped"):
        rig.body.move(plan_move(rig.robot, rig.robot.neutral, rig.robot.lower, 1.0))
    rig.body.release()
    rig.run(0.1)
    with pytest.raises(BodyError, match="returning"):
        rig.body.move(plan_move(rig.robot, rig.robot.neutral, rig.robot.lower, 1.0))
    assert rig.settle() is Phase.IDLE
    rig.close()


#: What each changed line of the firmware would do, and which test notices it.
MUTANTS = {
    "forgets a hand at each move": (
        "  if (goes_on) {\n    restart(c.watch, elapsed);\n  } else {\n    begin(c.watch, rule);\n"
        "  }",
        "  begin(c.watch, rule);",
        test_no_number_of_moves_makes_the_rule_forget_a_hand,
    ),
    "takes all for punctual": (
        "elapsed + late[motor] - c.late[motor]",
        "elapsed",
        lambda firmware: test_an_order_that_is_damaged_within_a_move_is_no_contact(
            firmware, (0, 1)
        ),
    ),
    "takes motors for still": (
        "velocity = speed_at(before, until) * c.watch.direction[motor];",
        "velocity = 0;",
        lambda firmware: test_free_moves_that_replace_one_another_are_never_stopped(firmware, 0),
    ),
}


@pytest.mark.proof("test_free_moves_that_replace_one_another_are_never_stopped")
@pytest.mark.parametrize("name", MUTANTS)
def test_a_changed_card_is_noticed(firmware: Path, tmp_path: Path, name: str) -> None:
    text, other, notices = MUTANTS[name]
    built = changed_card(tmp_path, "controller.h", text, other)
    try:
        notices(built)
    except (AssertionError, BodyError, pytest.fail.Exception):
        return
    pytest.fail("the changed card passed")
