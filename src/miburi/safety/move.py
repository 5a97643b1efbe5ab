"""Moves: goals and speeds, which in the paper the phone sends to the card (Section 2).

:func:`plan_move` takes two poses and a duration and returns a :class:`Move`, in which all motors
start and arrive together. :func:`plan_on` does the same for motors that are under way already.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from miburi.errors import InputError
from miburi.robot import JOINTS, Array, Robot
from miburi.safety.drive import aim
from miburi.safety.profile import FINE, Steps, to_steps


@dataclass(frozen=True)
class Move:
    """One command to a body: where each motor ends, and how fast it may turn (Section 2).

    Attributes
    ----------
    angles
        The goals, (8,) rad.
    speeds
        The largest speeds, (8,) rad/s; not negative.
    slows_at, ends_at
        When the first motor slows down for its goal, and when all motors have arrived, in seconds
        after the move's start. Both are 0 if the move was not planned.

    Raises
    ------
    InputError
        A shape is not (8,), a value is not finite, or a speed is negative.
    """

    angles: Array
    speeds: Array
    slows_at: float = 0.0
    ends_at: float = 0.0

    def __post_init__(self) -> None:
        for name, values in (("angles", self.angles), ("speeds", self.speeds)):
            if values.shape != (len(JOINTS),) or not np.all(np.isfinite(values)):
                raise InputError(f"{name} must be {len(JOINTS)} finite numbers, got {values!r}.")
        if np.any(self.speeds < 0):
            raise InputError(f"speeds must not be negative, got {self.speeds!r}.")


class Course(NamedTuple):
    """The motors' commanded positions and velocities at present, on their profiles.

    Attributes
    ----------
    angles, velocities
        (8,) rad and (8,) rad/s. Like the goals that the servos get, they allow for sag.
    """

    angles: Array
    velocities: Array

    @classmethod
    def of(cls, robot: Robot, place: Steps, velocity: Steps) -> "Course":
        """Convert positions in 1/256 steps and velocities in 1/256 steps/s, (8,), to a course."""
        step = robot.servo.step / FINE
        return cls(np.multiply(place, step), np.multiply(velocity, step))


def plan_move(robot: Robot, start: Array, end: Array, duration: float) -> Move:
    """Plan one move in which all motors start together and arrive together.

    A motor that travels the distance d in the time T, with the servo's ramp a at both ends,
    cruises at v = (aT − √(a²T² − 4ad)) / 2.

    ``start`` and ``end`` are (8,) rad; ``duration`` is in seconds. The move takes longer if a motor
    cannot arrive in that time.

    Raises
    ------
    InputError
        The duration is not a positive number.
    """
    if not duration > 0:
        raise InputError(f"duration must be more than 0 s, got {duration!r}.")
    ramp, fastest = robot.servo.acceleration, robot.servo.max_speed
    # Distances are taken between goals (which allow for sag) in whole steps, as the servos round
    # them; otherwise a fraction of a step would change a speed.
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
    slows_at = time - float(speeds.max()) / ramp
    return Move(np.array(end, dtype=np.float64), speeds, slows_at, time)


def plan_on(robot: Robot, course: Course, end: Array, duration: float) -> Move:
    """Plan a move of motors that are under way, in which all arrive together.

    A motor that starts with the speed u, and still has the distance d to go, cruises at the speed
    v. If it has to speed up, v = (aT + u − √((aT + u)² − 4ad − 2u²)) / 2. If it has to slow down,
    v = (d − u² / 2a) / (T − u / a).

    ``course`` gives the motors' present positions and speeds; the rest is as in :func:`plan_move`.

    Raises
    ------
    InputError
        The duration is not a positive number.
    """
    if not duration > 0:
        raise InputError(f"duration must be more than 0 s, got {duration!r}.")
    a, fastest = robot.servo.acceleration, robot.servo.max_speed
    way = aim(robot, end) - course.angles
    stops = course.velocities * np.abs(course.velocities) / (2 * a)
    direction = np.where(way < stops, -1.0, 1.0)
    d, u = way * direction, course.velocities * direction
    # The shortest time is that of a triangular profile, or of a trapezoidal one at the top speed.
    tip = np.minimum(np.sqrt(np.maximum(a * d + u * u / 2, 0.0)), fastest)
    shortest = (d + (2 * tip * tip - 2 * tip * u + u * u) / (2 * a)) / np.maximum(tip, 1e-9)
    time = max(duration, float(np.where(tip > 1e-6, shortest, 0.0).max()))
    under_root = np.maximum((a * time + u) ** 2 - 4 * a * d - 2 * u * u, 0.0)
    faster = (a * time + u - np.sqrt(under_root)) / 2
    slower = (d - u * u / (2 * a)) / np.maximum(time - u / a, 1e-9)
    speeds = np.clip(np.where(d >= u * time - u * u / (2 * a), faster, slower), 0.0, fastest)
    return Move(np.array(end, dtype=np.float64), speeds, time - float(speeds.max()) / a, time)
