"""Specimens are spread as widely as they promise, and differ in nothing else."""

from math import radians

import numpy as np

from miburi.robot import Robot
from miburi.robot.specimens import specimens


def test_specimens_fill_their_ranges(robot: Robot) -> None:
    built, nominal = specimens(robot, 1, 200), robot.servo.model
    servos = [one.robot.servo.model for one in built]

    def fill(values: list[float], low: float, high: float) -> None:
        assert low <= min(values) < low + 0.06 * (high - low)
        assert high - 0.06 * (high - low) < max(values) <= high

    for divisor, every in ((256.0, servos[::2]), (128.0, servos[1::2])):
        fill([np.log2(divisor / servo.divisor.p_divisor) for servo in every], -1.0, 1.0)
    for name in ("dry", "stiction", "motor_load", "load_stiction"):
        was = getattr(nominal.friction, name)
        fill([np.log2(getattr(servo.friction, name) / was) for servo in servos], -1.0, 1.0)
    fill([servo.motor.resistance / nominal.motor.resistance for servo in servos], 0.8, 1.2)
    fill([servo.supply.voltage for servo in servos], 4.75, 5.25)
    fill([servo.loop.backlash for servo in servos], 0.0, radians(0.5))
    fill([one.start_delay for one in built], 0.0, 0.003)
    fill([one.clock for one in built], 0.995, 1.005)
    for name, mass in robot.masses.model_dump().items():
        fill([getattr(one.robot.masses, name) / mass for one in built], 0.9, 1.1)


def test_what_nobody_can_get_wrong_is_as_described(robot: Robot) -> None:
    (one,) = specimens(robot, 3, 1)
    servo, nominal = one.robot.servo.model, robot.servo.model
    assert (servo.encoder, servo.drive, servo.gains) == (
        nominal.encoder, nominal.drive, nominal.gains,
    )  # fmt: skip
    assert one.robot.with_servo(nominal).model_copy(update={"masses": robot.masses}) == robot


def test_the_same_seed_builds_the_same_robots(robot: Robot) -> None:
    assert specimens(robot, 1, 3) == specimens(robot, 1, 5)[:3]
    assert specimens(robot, 1, 1) != specimens(robot, 2, 1)


def test_all_may_be_given_one_play_and_differ_as_before(robot: Robot) -> None:
    for loose, own in zip(specimens(robot, 1, 3, play=0.01), specimens(robot, 1, 3), strict=True):
        loop = loose.robot.servo.model.loop
        assert loop.backlash == 0.01
        drawn = own.robot.servo.model.loop
        servo = loose.robot.servo.model.model_copy(update={"loop": drawn})
        assert loose.robot.with_servo(servo) == own.robot
