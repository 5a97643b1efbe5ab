"""What a body is told (``Move``) and the ramped motion that its motors then make (``Profile``).

Motors count: positions are whole encoder steps, times whole microseconds. All arithmetic on
profiles is integer, so that the firmware, in C++ on an 8-bit card, gets the same numbers to the
last bit.
"""

from dataclasses import dataclass
from math import isqrt

import numpy as np
from numpy.typing import NDArray

from miburi.robot import Array, Robot

__all__ = ["FINE", "SECOND", "Profile", "Steps", "commanded", "to_steps"]

Steps = NDArray[np.int64]

#: A profile's position is counted in this many parts of an encoder step.
FINE = 256
#: Microseconds in a second.
SECOND = 1_000_000


def to_steps(robot: Robot, angles: Array) -> Steps:
    """Return the encoder steps, (8,), nearest to ``angles`` (rad); zero angle is step zero."""
    steps: Steps = np.rint(np.asarray(angles) / robot.servo.step).astype(np.int64)
    return steps


@dataclass(frozen=True)
class Profile:
    """Ramped motion of some motors from rest to rest: speed up, cruise, slow down.

    Distances are steps (not negative: the direction is kept apart), speeds steps/s,
    accelerations steps/s², times µs since the start; all (n,) int64. A distance too short to
    reach the cruising speed makes a triangle.
    """

    distance: Steps
    speed: Steps
    acceleration: Steps
    ramp: Steps
    total: Steps

    @classmethod
    def plan(cls, distance: Steps, speed: Steps, acceleration: Steps) -> "Profile":
        """Work out ramp and total time; speeds and accelerations are at least 1."""
        full_ramp = speed * SECOND // acceleration
        # A triangle's ramp is √(d/a); it is one where that is less than the full ramp.
        short_ramp = np.array(
            [
                isqrt(int(d) * SECOND * SECOND // int(a))
                for d, a in zip(distance, acceleration, strict=True)
            ],
            dtype=np.int64,
        )
        ramp = np.minimum(full_ramp, short_ramp)
        total = np.where(
            short_ramp < full_ramp, 2 * short_ramp, distance * SECOND // speed + full_ramp
        )
        return cls(distance, speed, acceleration, ramp, total)

    @property
    def fastest(self) -> Steps:
        """The largest speed that each motor comes to, (n,) steps/s; a triangle's is its tip."""
        fastest: Steps = np.minimum(self.speed, self.acceleration * self.ramp // SECOND)
        return fastest

    def position(self, time: Steps | int) -> Steps:
        """Travel in 1/256 steps after ``time`` µs, broadcast against the motors."""
        t = np.minimum(np.maximum(time, 0), self.total)
        left = self.total - t
        # Clipped to the ramp, a t² · 128 stays inside 64 bits for every servo allowed.
        risen = np.minimum(t, self.ramp)
        rising = self.acceleration * risen * risen * (FINE // 2) // SECOND**2
        to_go = np.minimum(left, self.ramp)
        falling = (
            self.distance * FINE - self.acceleration * to_go * to_go * (FINE // 2) // SECOND**2
        )
        cruising = self.speed * (2 * t - self.ramp) * (FINE // 2) // SECOND
        return np.where(t < self.ramp, rising, np.where(left <= self.ramp, falling, cruising))


def commanded(robot: Robot, origin: Steps, goal: Steps, speeds: Steps) -> tuple[Profile, Steps]:
    """Plan the servos' motion from ``origin`` to ``goal`` (8,) steps at ``speeds`` steps/s.

    Returns
    -------
    The profile, and the direction of each motor: (8,) +1 or −1.
    """
    way = goal - origin
    ramp = np.full_like(way, round(robot.servo.acceleration / robot.servo.step))
    profile = Profile.plan(np.abs(way), np.maximum(speeds, 1), ramp)
    return profile, np.where(way < 0, -1, 1)
