"""Moves: the final positions and speeds that the paper's phone sends to the card (Section 2).

:func:`plan_move` takes two poses and a duration and returns a :class:`Move`, in which all motors
start and arrive together.
"""

from dataclasses import dataclass

import numpy as np

from miburi.errors import InputError
from miburi.robot import JOINTS, Array, Robot
from miburi.safety.drive import aim
from miburi.safety.profile import to_steps

__all__ = ["Move", "plan_move"]


@dataclass(frozen=True)
class Move:
    """One command to a body: where each motor ends, and how fast it may turn (Section 2).

    Attributes
    ----------
    angles
        (8,) rad, where each motor ends.
    speeds
        (8,) rad/s, the largest speed of each motor; not negative.

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


def plan_move(robot: Robot, start: Array, end: Array, duration: float) -> Move:
    """Plan one move in which all motors start together and arrive together.

    A motor that travels the distance d in the time T, with the servo's ramp a at both ends,
    cruises at v = (aT − √(a²T² − 4ad)) / 2.

    Parameters
    ----------
    robot
        Gives the servo's acceleration and largest speed.
    start, end
        (8,) rad.
    duration
        s; a move takes longer if a motor cannot arrive in that time.

    Raises
    ------
    InputError
        The duration is not a positive number.
    """
    if not duration > 0:
        raise InputError(f"duration must be more than 0 s, got {duration!r}.")
    ramp, fastest = robot.servo.acceleration, robot.servo.max_speed
    # Motors go from goal to goal, which lie above the sag, and count whole steps: a fraction of a
    # step must not change a speed.
    step = robot.servo.step
    distance = (
        np.abs(np.diff(to_steps(robot, aim(robot, np.array([start, end]))), axis=0)[0]) * step
    )
    needed = np.where(
        distance > fastest**2 / ramp,
        distance / fastest + fastest / ramp,
        2 * np.sqrt(distance / ramp),
    )
    time = max(duration, float(needed.max()))
    under_root = np.maximum((ramp * time) ** 2 - 4 * ramp * distance, 0.0)
    speeds = np.minimum((ramp * time - np.sqrt(under_root)) / 2, fastest)
    return Move(np.array(end, dtype=np.float64), speeds)
