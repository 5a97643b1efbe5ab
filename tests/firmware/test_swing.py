"""The card begins a move with the speed that a motor has, as the reference does."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.firmware.rig import Rig, calibrated
from tests.firmware.toolchain import HERE, NATIVE, SANITIZED, changed_card, run

from miburi.card.settings import CardSettings, FreeMotor
from miburi.robot import JOINTS, iphonoid
from miburi.safety.contact import Rule
from miburi.safety.controller import Controller
from miburi.safety.move import Move
from miburi.safety.profile import to_steps
from miburi.safety.stop import Phase, StopReason

MOTOR, SPEED = 2, 300


def swinging() -> CardSettings:
    """Return settings of a rig of which one motor swings on when it was moved."""
    settings = calibrated()
    joints = [*settings.joints]
    joints[MOTOR] = replace(
        settings.generous.joints[MOTOR], free=FreeMotor(pull=4000, brake=8000, friction=0, lost=0)
    )
    return replace(settings, joints=tuple(joints))


@pytest.mark.parametrize("way", [-1, 1])
def test_a_motor_that_still_moves_begins_its_move_so(firmware: Path, way: int) -> None:
    """It goes 15 steps, is told to move, and is blocked: the twin expects the same of it."""
    rig = Rig(firmware, 7, settings=swinging())
    shaft, clock = rig.servos[MOTOR].shaft, rig.line.mega
    angles = rig.robot.neutral.copy()
    began = clock.time
    shaft.noise = lambda: way * min((clock.time - began) * 1e-6 * SPEED, 15.0)
    rig.run(0.035)
    assert rig.body.state.phase is Phase.IDLE
    shaft.low = shaft.high = shaft.place
    angles[MOTOR] -= 0.5
    rig.body.move(Move(angles, np.full(8, 1.0)))
    watch = rig.twin.controller.watch
    assert abs(watch.loading.velocity[MOTOR] / 256) > 150
    assert rig.settle() is Phase.STOPPED
    assert rig.cause == (StopReason.CONTACT, JOINTS[MOTOR])
    rig.close()


def test_the_card_tells_of_readings_what_the_reference_does(tmp_path: Path) -> None:
    """Of readings in time and late, of jumps, of flicker, and of a start from another place."""
    run(*NATIVE, *SANITIZED, HERE / "drift_native.cpp", "-o", tmp_path / "drift")
    robot, rng = iphonoid(), np.random.default_rng(5)
    controller = Controller(robot, Rule.of(robot), to_steps(robot, robot.neutral))
    time, places, lines, expected = 100_000, np.zeros(8, dtype=np.int64), [], []
    for _ in range(3000):
        time += int(rng.choice([0, 19_000, 20_000, 28_000, 60_000, 60_001, 90_000]))
        steps = rng.integers(-3, 4, 8) * rng.choice([0, 1, 1, 6, 40, 400, 9000], 8)
        places = np.clip(places + steps, -16_000, 16_000)
        start = time + int(rng.choice([0, 3000, 20_000, 60_000, 60_001]))
        moved_on = places + (rng.random(8) < 0.1)
        lines += [time, start, *np.stack([places, moved_on]).T.ravel().tolist()]
        controller.note(places, time)
        for way in (-1, 1):
            told = controller.drift(moved_on, np.full(8, way), start)
            expected += np.stack(told).T.ravel().tolist()
    said = run(tmp_path / "drift", data=" ".join(map(str, [3000, *lines])).encode())
    assert [int(each) for each in said.split()] == expected
    assert 0.1 < np.mean(np.array(expected) != 0) < 0.7


#: What each changed line of the firmware would do, and which it is.
MUTANTS = {
    "stands": ("loading.velocity = static_cast<int32_t>(fast);", "loading.velocity = 0;"),
    "reads at once": ("static_cast<int32_t>(fast * age / SECOND);", "0;"),
    "goes the other way": ("(c.moved[motor]) * c.watch.direction[motor];", "(c.moved[motor]);"),
    "never reads": ("  note(c, positions, time);\n", ""),
}


@pytest.mark.proof("test_the_card_tells_of_readings_what_the_reference_does")
@pytest.mark.parametrize("name", MUTANTS)
def test_a_changed_card_is_noticed(firmware: Path, tmp_path: Path, name: str) -> None:
    built = changed_card(tmp_path, "controller.h", *MUTANTS[name])
    for way in (-1, 1):
        try:
            test_a_motor_that_still_moves_begins_its_move_so(built, way)
        except AssertionError:
            return
    pytest.fail("the changed card passed")
