"""Profiles: the ramped motion that the servos make of a move.

In go start, goal and speed of each motor; out comes a :class:`Profile`, which gives the commanded
position at any time. Positions are whole encoder steps and times whole µs. All arithmetic is
integer, so that the firmware, in C++ on an 8-bit card, gets the same numbers to the last bit.
"""

from dataclasses import dataclass
from math import isqrt

import numpy as np
from numpy.typing import NDArray

from miburi.robot import Array, Robot

__all__ = ["FINE", "SECOND", "Profile", "Steps", "plan_profile", "to_steps"]

Steps = NDArray[np.int64]

#: Positions on a profile are counted in parts of an encoder step; this many make a step.
FINE = 256
#: Microseconds in a second.
SECOND = 1_000_000


def to_steps(robot: Robot, angles: Array) -> Steps:
    """Return the encoder steps, (8,), nearest to ``angles`` (rad); zero angle is step zero."""
    steps: Steps = np.rint(np.asarray(angles) / robot.servo.step).astype(np.int64)
    return steps


@dataclass(frozen=True)
class Profile:
    """Ramped motion of n motors from rest to rest: speed up, cruise, slow down.

    A motor that does not get far enough to reach its cruising speed only speeds up and slows down:
    a triangle.

    Attributes
    ----------
    distance
        (n,) steps, never negative: the direction is separate. All are int64.
    speed, acceleration
        (n,) the cruising speed in 1/256 steps/s, and the ramps' acceleration in steps/s².
    ramp, total
        (n,) how long it speeds up, and the whole move, in µs.
    """

    distance: Steps
    speed: Steps
    acceleration: Steps
    ramp: Steps
    total: Steps

    @classmethod
    def plan(cls, distance: Steps, speed: Steps, acceleration: Steps) -> "Profile":
        """Compute ramp and total time; speeds and accelerations must be at least 1."""
        full_ramp = speed * SECOND // (acceleration * FINE)
        # The ramp of a triangle is √(d/a); a motion is a triangle if that is the shorter ramp.
        short_ramp = np.array(
            [
                isqrt(int(d) * SECOND * SECOND // int(a))
                for d, a in zip(distance, acceleration, strict=True)
            ],
            dtype=np.int64,
        )
        ramp = np.minimum(full_ramp, short_ramp)
        total = np.where(
            short_ramp < full_ramp,
            2 * short_ramp,
            distance * FINE * SECOND // speed + full_ramp,
        )
        return cls(distance, speed, acceleration, ramp, total)

    @property
    def fastest(self) -> Steps:
        """The top speed that each motor reaches, (n,) 1/256 steps/s; a triangle's is at its tip."""
        fastest: Steps = np.minimum(self.speed, self.acceleration * self.ramp * FINE // SECOND)
        return fastest

    def position(self, time: Steps | int) -> Steps:
        """Return the travel in 1/256 steps after ``time`` µs, broadcast against the motors."""
        t = np.minimum(np.maximum(time, 0), self.total)
        left = self.total - t
        # With t clipped to the ramp, a t² · 128 fits into 64 bits for every allowed servo.
        risen = np.minimum(t, self.ramp)
        rising = self.acceleration * risen * risen * (FINE // 2) // SECOND**2
        to_go = np.minimum(left, self.ramp)
        falling = (
            self.distance * FINE - self.acceleration * to_go * to_go * (FINE // 2) // SECOND**2
        )
        cruising = self.speed * (2 * t - self.ramp) // (2 * SECOND)
        return np.where(t < self.ramp, rising, np.where(left <= self.ramp, falling, cruising))


def plan_profile(robot: Robot, origin: Steps, goal: Steps, speeds: Steps) -> tuple[Profile, Steps]:
    """Plan the servos' motion from ``origin`` to ``goal``, (8,) steps, at ``speeds`` in steps/s.

    Returns
    -------
    The profile, and the direction of each motor: (8,) +1 or −1.
    """
    distance = goal - origin
    ramp = np.full_like(distance, round(robot.servo.acceleration / robot.servo.step))
    profile = Profile.plan(np.abs(distance), np.maximum(speeds, 1) * FINE, ramp)
    return profile, np.where(distance < 0, -1, 1)
