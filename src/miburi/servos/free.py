"""The motion of unhindered servos: a model in integers, as the Arduino card computes it.

Motors act like springs between their commanded profiles and their joints, with back EMF, friction
and the weight of what they carry (:mod:`miburi.servos.voltage`). For each step of 5 ms, the model
computes

    motor  = a1 · (profile − x, at most ± most) − a2 · v
    v     += motor − a1 · sag, then less the dry friction, which at most stops it
    x     += v

Positions are in 1/65536 encoder steps, v is in 1/65536 encoder steps per 5 ms. Shifts round down,
as in C; everything fits into 32 bits. Importing this module loads Numba.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from miburi.ground.compiled import compiled
from miburi.servos.servo import Servo
from miburi.servos.voltage import Array

Steps = NDArray[np.int64]

#: The length of the model's time step, in µs.
STEP = 5000
#: The limits of speed (128 encoder steps in 5 ms) and position (four turns) in the model, so that
#: its numbers fit into 32 bits. No servo reaches these limits, unless it has no friction and its
#: motor gives the greatest torque allowed.
FASTEST, FARTHEST = 0x7FFFFF, 0x40000000
#: The integers that stand for 1: in the coefficients, and in the share of a torque that the gears
#: absorb.
_ONE, _SHARE = 1 << 16, 1 << 8


class FreeServo(NamedTuple):
    """The eight motors with their joints; all fields are (8,) int64.

    Attributes
    ----------
    pull, brake
        a1 and a2, in 1/65536: the speed that a step adds for each unit of position error, and takes
        away for each unit of speed.
    friction
        The speed that dry friction takes away in a step, in 1/65536 encoder step per 5 ms.
    lost
        The share of the motor's torque that the gears absorb as friction, in 1/256.
    """

    pull: Steps
    brake: Steps
    friction: Steps
    lost: Steps

    @classmethod
    def of(cls, servo: Servo, load: Array) -> "FreeServo":
        """Return motors at nominal voltage that move the inertias ``load``, (8,) in kg·m²."""
        inertia = servo.motor.armature + load
        per_torque = (STEP / 1e6) ** 2 / inertia
        brake = (servo.damping + servo.control_damping) * (STEP / 1e6) / inertia
        dry = (servo.friction.dry + servo.friction.stiction) / servo.step

        def whole(values: Array | float) -> Steps:
            steps: Steps = np.rint(np.broadcast_to(values, inertia.shape)).astype(np.int64)
            return steps

        return cls(
            pull=whole(servo.stiffness * per_torque * _ONE),
            brake=whole(brake * _ONE),
            friction=whole(dry * per_torque * _ONE),
            lost=whole(servo.friction.motor_load * _SHARE),
        )

    def scaled(self, stiffness: Array, damping: Array, friction: Array) -> "FreeServo":
        """Return motors with pull, brake and friction multiplied by these factors, (8,) each."""
        times = ((self.pull, stiffness), (self.brake, damping), (self.friction, friction))
        pull, brake, dry = (np.rint(each * share).astype(np.int64) for each, share in times)
        return FreeServo(pull, brake, dry, self.lost)


@compiled
def advance(
    x: Steps,
    v: Steps,
    before: Steps,
    now: Steps,
    steps: int,
    sag: Steps,
    most: Steps,
    servo: FreeServo,
) -> None:
    """Advance ``x`` and ``v`` (8,) by ``steps`` steps, along with the profile.

    The profile goes from ``before`` to ``now``, ``sag`` is the error needed to hold the load, and
    ``most`` is the error at which the duty reaches its limit. All four are (8,), in 1/256 encoder
    step.
    """
    for j in range(len(x)):
        for k in range(1, steps + 1):
            profile = before[j] + (now[j] - before[j]) * k // steps
            error = min(max(profile - (x[j] >> 8), -most[j]), most[j])
            motor = ((servo.pull[j] * error) >> 8) - ((servo.brake[j] * (v[j] >> 8)) >> 8)
            speed = v[j] + motor - ((servo.pull[j] * sag[j]) >> 8)
            taken = servo.friction[j] + ((servo.lost[j] * abs(motor)) >> 8)
            free = max(speed - taken, 0) if speed > 0 else min(speed + taken, 0)
            v[j] = min(max(free, -FASTEST), FASTEST)
            x[j] = min(max(x[j] + v[j], -FARTHEST), FARTHEST)


@compiled
def travel(profile: Steps, sag: Steps, most: Steps, servo: FreeServo) -> Steps:
    """Return the positions through a whole move, (n, 8) in 1/256 encoder step, from rest at 0.

    ``profile`` and ``sag`` (n, 8) hold the values at the end of each step of the model.
    """
    way = np.zeros_like(profile)
    x, v = np.zeros_like(most), np.zeros_like(most)
    for k in range(1, len(profile)):
        advance(x, v, profile[k - 1], profile[k], 1, sag[k], most, servo)
        way[k] = x >> 8
    return way
