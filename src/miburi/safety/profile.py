"""Profiles: the ramped motion with which the servos carry out a move.

A :class:`Profile` follows from each motor's start, goal and speed, and gives the commanded position
at any time. Positions are whole encoder steps and times whole µs. All arithmetic is integer, so
that the firmware on an 8-bit processor computes exactly the same numbers.

A move that replaces another starts at each motor's present speed. So does the servo: its manual
calls it *velocity override*.
"""

from dataclasses import dataclass, field
from math import isqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from miburi.robot import Array, Robot

Steps = NDArray[np.int64]

#: Positions on a profile are counted in parts of an encoder step; a step has this many.
FINE = 256
SECOND = 1_000_000


def to_steps(robot: Robot, angles: Array) -> Steps:
    """Return the encoder steps nearest to ``angles``, (8,) in rad; the angle 0 is the step 0."""
    steps: Steps = np.rint(np.asarray(angles) / robot.servo.step).astype(np.int64)
    return steps


def truncated(number: Steps, by: Steps | int) -> Steps:
    """Return the quotient rounded towards zero, as in C++; ``by`` is more than 0."""
    quotient: Steps = np.sign(number) * np.floor_divide(np.abs(number), by, dtype=np.int64)
    return quotient


@dataclass(frozen=True)
class Profile:
    """Ramped motion of n motors until they come to rest: speed up, cruise, slow down.

    A motor that does not get far enough to reach its cruising speed only speeds up and slows down:
    a triangle. A motor that begins above its cruising speed slows down to that speed first. A motor
    that begins in the wrong direction reverses on its first ramp.

    Attributes
    ----------
    distance
        (n,) steps along the motor's direction, which is kept elsewhere. It is negative only where a
        motor cannot stop in time: it passes its goal and comes back. All attributes are int64.
    speed, acceleration
        (n,) the cruising speed in 1/256 steps/s, and the ramps' acceleration in steps/s².
    ramp, total, fall
        (n,) durations in µs: of the first ramp, of the whole motion, and of the braking at the end.
    initial
        (n,) speed at the start, in 1/256 steps/s along the direction; 0 for a start from rest.
    shift
        (n,) twice the time that is lost compared with a start at cruising speed, in µs; negative if
        the motor starts faster.
    fastest
        (n,) the top speed that each motor reaches, in 1/256 steps/s; a triangle reaches it at its
        tip.
    """

    distance: Steps
    speed: Steps
    acceleration: Steps
    ramp: Steps
    total: Steps
    fall: Steps
    initial: Steps
    shift: Steps
    fastest: Steps = field(init=False)
    _moves: bool = field(init=False)
    _slows: Steps = field(init=False)

    def __post_init__(self) -> None:
        # Nearly all moves begin at rest, and then there is less to compute.
        object.__setattr__(self, "_moves", bool(self.initial.any()))
        tip = np.minimum(self.speed, self.acceleration * self.fall * FINE // SECOND)
        object.__setattr__(self, "fastest", np.maximum(tip, np.abs(self.initial)))
        object.__setattr__(self, "_slows", np.where(self.initial > tip, -1, 1))

    @classmethod
    def plan(
        cls, distance: Steps, speed: Steps, acceleration: Steps, initial: Steps | None = None
    ) -> "Profile":
        """Compute ramps and total time; speeds and accelerations must be at least 1.

        ``distance`` must be at least the stopping distance of a motor with an ``initial`` speed. A
        motor that moves backwards stops behind its start, so ``distance`` may be negative.
        """
        initial = np.zeros_like(distance) if initial is None else initial
        full = speed * SECOND // (acceleration * FINE)
        halt = truncated(initial * SECOND, acceleration * FINE)  # from the initial speed to rest
        # The last ramp of a triangle is √(d/a + halt²/2); if that is shorter than the full ramp,
        # the profile is a triangle.
        squares = truncated(distance * SECOND * SECOND, acceleration) + halt * halt // 2
        short = np.array([isqrt(max(square, 0)) for square in squares.tolist()], dtype=np.int64)
        triangle = short < full
        fall = np.where(triangle, short, full)
        ramp = np.where(triangle, np.maximum(short - halt, 0), np.abs(full - halt))
        shift = truncated(ramp * (speed - initial), speed)
        cruises = truncated(distance * FINE * SECOND, speed) + truncated(shift + full, 2)
        total = np.where(triangle, ramp + fall, cruises)
        return cls(distance, speed, acceleration, ramp, total, fall, initial, shift)

    def position(self, time: Steps | int) -> Steps:
        """Return the travel in 1/256 steps after ``time`` µs, broadcast against the motors.

        Before the start, the motor counts as moving at its initial speed.
        """
        t: Steps = np.minimum(np.maximum(time, 0), self.total)
        left = self.total - t
        # With t clipped to the ramp, a · t² · 128 fits into 64 bits for every allowed servo.
        risen = np.minimum(t, self.ramp)
        rising = self.acceleration * risen * risen * (FINE // 2) // SECOND**2
        to_go = np.minimum(left, self.fall)
        falling = (
            self.distance * FINE - self.acceleration * to_go * to_go * (FINE // 2) // SECOND**2
        )
        if not self._moves:
            cruising = self.speed * (2 * t - self.shift) // (2 * SECOND)
            return np.where(t < self.ramp, rising, np.where(left <= self.fall, falling, cruising))
        time = np.asarray(time, dtype=np.int64)
        began = truncated(self.initial * np.minimum(time, risen), SECOND)
        rising = began + np.where(time < 0, 0, self._slows * rising)
        cruising = truncated(self.speed * (2 * t - self.shift), 2 * SECOND)
        return np.where(time < self.ramp, rising, np.where(left <= self.fall, falling, cruising))

    def velocity(self, time: int) -> Steps:
        """Return the speed along the direction after ``time`` µs, (n,) 1/256 steps/s."""
        t = np.minimum(max(time, 0), self.total)
        left = self.total - t
        rising = self.initial + self._slows * (self.acceleration * t * FINE // SECOND)
        falling = self.acceleration * left * FINE // SECOND
        slow = np.where(left <= self.fall, falling, self.speed)
        velocity: Steps = np.where(t < self.ramp, rising, slow)
        return velocity


class Motion(NamedTuple):
    """The motion of the motors: profiles, directions, and origins in steps."""

    profile: Profile
    direction: Steps
    origin: Steps

    def at(self, time: int) -> tuple[Steps, Steps]:
        """Return position and velocity after ``time`` µs, in 1/256 steps and 1/256 steps/s."""
        travel, speed = self.profile.position(time), self.profile.velocity(time)
        return self.origin * FINE + self.direction * travel, self.direction * speed


def whole(places: Steps) -> Steps:
    """Round positions in 1/256 steps to whole steps."""
    steps: Steps = (places + FINE // 2) >> 8
    return steps


def plan_profile(
    robot: Robot,
    origin: Steps,
    goal: Steps,
    speeds: Steps,
    velocity: Steps | None = None,
    before: Steps | int = 1,
) -> tuple[Profile, Steps]:
    """Plan the servos' motion from ``origin`` to ``goal``, (8,) steps, at ``speeds`` in steps/s.

    ``velocity`` is the speed on each motor's profile at the origin, (8,) 1/256 steps/s; None if the
    motors are at rest. ``before`` is the direction until now; a motor that does not move keeps it.

    Returns the profile, and each motor's direction, (8,) +1 or −1.
    """
    acceleration = np.full_like(goal, round(robot.servo.acceleration / robot.servo.step))
    fast = np.maximum(speeds, 1) * FINE
    return plan_towards(origin, goal, fast, acceleration, velocity, before)


def plan_towards(
    origin: Steps,
    goal: Steps,
    speed: Steps,
    acceleration: Steps,
    velocity: Steps | None = None,
    before: Steps | int = 1,
) -> tuple[Profile, Steps]:
    """Plan as :func:`plan_profile` does.

    ``speed`` is in 1/256 steps/s, and ``acceleration`` in steps/s².
    """
    way = goal - origin
    velocity = np.zeros_like(way) if velocity is None else velocity
    # A motor's direction depends on where it would stop.
    stops = truncated(velocity * np.abs(velocity), 2 * FINE * acceleration)
    stays = (way == 0) & (velocity == 0)
    direction = np.where(stays, before, np.where(way * FINE < stops, -1, 1))
    return Profile.plan(way * direction, speed, acceleration, velocity * direction), direction
