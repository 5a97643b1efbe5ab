"""Calibrate emulated cards whose robots differ from their description, and let them gesture freely.

    python bench/servos/cards.py [SEED] [ROBOTS]

Each robot is a specimen of a workshop (`miburi.robot.specimens`); the card runs the real binary,
and knows the description alone. After its calibration it performs all gestures at three moods, each
in another variation: every stop is a false one. What was found is beside what is true.
"""

import sys

import numpy as np

from miburi import ik
from miburi.card.calibration import measure
from miburi.card.card import Card, wake
from miburi.card.settings import CardSettings
from miburi.emulation.body import EmulatedRobot
from miburi.errors import BodyError
from miburi.feelings import FEELINGS
from miburi.gestures import key_poses, load
from miburi.robot import Robot, iphonoid
from miburi.robot.specimens import Specimen, specimens
from miburi.safety.move import plan_move
from miburi.safety.stop import Phase

MOODS = (0.3, 0.6, 1.0)


def perform(card: Card, robot: Robot, seed: int) -> tuple[int, int]:
    """Perform all gestures freely; return the moves made, and the false stops."""
    wake(card)
    moves, stops = 0, 0
    for mood in MOODS:
        for number, feeling in enumerate(FEELINGS):
            angles = robot.neutral
            for pose in key_poses(robot, load(feeling), mood, variation=100 * seed + number):
                there = ik.solve(robot, pose.target, start=angles).angles
                card.move(plan_move(robot, angles, there, pose.duration))
                angles, moves = there, moves + 1
                while card.step(0.02).phase is Phase.MOVING:
                    pass
                if card.state.phase is Phase.STOPPED:
                    stop = card.state.stop
                    print("   ", mood, feeling, stop.reason.value, stop.motor, stop.sign)
                    stops += 1
                    wake(card)
                    break
    return moves, stops


def conduct(robot: Robot, one: Specimen, seed: int) -> str:
    emulation = EmulatedRobot(robot, CardSettings.of(robot), one)
    card = Card(lambda: emulation, robot)
    found = measure(card)
    described, true = found.robot.servo.model, one.robot.servo.model
    # Of the motors: what the gears take of that is a share of its own.
    gain = found.settings.general.p_gain / true.drive.gain
    stiffness = found.found.stiffness * described.stiffness / (true.stiffness * gain)
    gears = (described.friction.dry / true.friction.dry) * found.found.friction
    moves, stops = perform(card, robot, seed)
    card.close()
    return (
        f"P {found.settings.general.p_gain:<5} {np.median(stiffness):4.2f} "
        f"({stiffness.min():4.2f}-{stiffness.max():4.2f})   {np.median(gears):4.2f} "
        f"({gears.min():4.2f}-{gears.max():4.2f})   {found.found.gravity[7]:4.2f} / "
        f"{one.robot.masses.phone / robot.masses.phone:4.2f}   "
        f"{found.seconds:4.0f} s   {stops}/{moves}"
    )


def main(seed: int = 1, count: int = 4) -> None:
    robot = iphonoid()
    print("found / true, median (all motors)")
    print("        stiffness          friction           phone's weight  took    false stops")
    for number, one in enumerate(specimens(robot, seed, count)):
        try:
            print(conduct(robot, one, number), flush=True)
        except BodyError as error:
            print("refused:", error, flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
