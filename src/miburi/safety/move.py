"""What a body is told: final positions and speeds (``Move``), as the paper's phone sends them."""

from dataclasses import dataclass

import numpy as np

from miburi.errors import InputError
from miburi.robot import JOINTS, Array, Robot

__all__ = ["Move", "synchronised"]


@dataclass(frozen=True)
class Move:
    """What the paper's phone sends to the card (Section 2).

    Attributes
    ----------
    angles
        (8,) rad, where each motor ends.
    speeds
        (8,) rad/s, how fast each motor may turn on its way; not negative.

    Raises
    ------
    InputError
        A shape is not (8,), a value is not finite, or a speed is negative.
    """

    angles: Array
    speeds: Array

    def __post_init__(self) -> None:
        for name, values in (("angles", self.angles), ("speeds", self.speeds)):
            if values.shape != (len(JOINTS),) or not np.all(np.isfinite(values)):
                raise InputError(f"{name} must be {len(JOINTS)} finite numbers, got {values!r}.")
        if np.any(self.speeds < 0):
            raise InputError(f"speeds must not be negative, got {self.speeds!r}.")


def synchronised(robot: Robot, start: Array, end: Array, duration: float) -> Move:
    """Plan one move in which all motors leave together and arrive together.

    With the servo's ramp a at both ends, a motor that has the distance d to go in the time T
    cruises at v = (aT − √(a²T² − 4ad)) / 2.

    Parameters
    ----------
    robot
        Gives ramp and fastest speed.
    start, end
        (8,) rad.
    duration
        s, wished for; stretched to what the slowest motor needs.

    Raises
    ------
    InputError
        The duration is not a positive number.
    """
    if not duration > 0:
        raise InputError(f"duration must be more than 0 s, got {duration!r}.")
    ramp, fastest = robot.servo.acceleration, robot.servo.max_speed
    # Whole steps, as the motors will count them: a fraction must not ask for a speed of its own.
    step = robot.servo.step
    distance = np.abs(np.rint(end / step) - np.rint(start / step)) * step
    needed = np.where(
        distance > fastest**2 / ramp,
        distance / fastest + fastest / ramp,
        2 * np.sqrt(distance / ramp),
    )
    time = max(duration, float(needed.max()))
    under_root = np.maximum((ramp * time) ** 2 - 4 * ramp * distance, 0.0)
    speeds = np.minimum((ramp * time - np.sqrt(under_root)) / 2, fastest)
    return Move(np.array(end, dtype=np.float64), speeds)
