"""Settings of the servos for a move: goals that allow for sag, and a ceiling for the force.

A position controller without an integral term acts like a spring: a motor sags below its goal by
its load divided by its stiffness. The load is known from the description, so goals are aimed that
much higher. The torque of a move is known, too, so the duty (Goal PWM) is limited to a little more
than the move needs. A person who holds a motor then feels no more force than that, whatever else
fails. Motors need the most torque while they speed up, so the ceiling is lower afterwards.
"""

from typing import NamedTuple

import numpy as np

from miburi.robot import Array, Robot
from miburi.robot.loads import loads
from miburi.safety.contact import UNLOADED, Loading
from miburi.safety.profile import FINE, Profile, Steps
from miburi.servos import required_torque

#: The duty limits allow for this many times the links' inertia, because the load in the hands is
#: unknown (our choice). With 10 g in each hand, the waist's inertia is up to 1.3 times as large,
#: and an arm's 1.4 to 1.6 times.
LADEN = 1.6
#: For this long (in µs) after the longest ramp, motors may still push as hard as when they speed
#: up: they lag behind their profiles, and their loads swing (our choice).
EASES_AFTER = 60_000
#: The points of the path at which loads are computed, as fractions of its length.
_SHARES = np.linspace(0.0, 1.0, 9)


def aim(robot: Robot, angles: Array) -> Array:
    """Return the goals with which loaded motors end at ``angles``, clipped to the limits.

    Both are (..., 8) rad.
    """
    servo = robot.servo.model
    lifted = angles + servo.drive.lift / servo.stiffness * loads(robot, angles).gravity
    goals: Array = np.clip(lifted, np.minimum(robot.lower, angles), np.maximum(robot.upper, angles))
    return goals


def uneased(robot: Robot) -> Robot:
    """Return a robot whose motors keep their first ceilings to the end, for calibrations.

    A lower ceiling would hold back a servo that is not measured yet, and would look like friction.
    """
    servo = robot.servo.model
    drive = servo.drive.model_copy(update={"room": 1.0})
    return robot.with_servo(servo.model_copy(update={"drive": drive}))


class Demand(NamedTuple):
    """The demands of a move on the motors.

    Attributes
    ----------
    ceiling
        (8,) N·m, the largest torque that is allowed: the stall torque at the duty limit.
    cruise
        (8,) N·m, the same from ``eases_at`` on; no more than ``ceiling``.
    eases_at
        When the lower ceiling begins, in µs from the move's start; by then all motors have sped up.
    loading
        The loads on the motors.
    """

    ceiling: Array
    cruise: Array
    eases_at: int
    loading: Loading


def demand(robot: Robot, start: Steps, origin: Steps, profile: Profile, direction: Steps) -> Demand:
    """Return what a move asks of the motors.

    ``start`` is where the motors are and ``origin`` where their profiles begin, both (8,) steps;
    ``direction`` is (8,) +1 or −1.
    """
    servo, step = robot.servo.model, robot.servo.step
    goal = origin + direction * profile.distance
    way = origin + np.multiply.outer(_SHARES, goal - origin)
    gravity, inertia = loads(robot, np.multiply(way, step, dtype=np.float64))
    needed = _needed(robot, profile, gravity * direction, LADEN * inertia)
    # The needed torque is the torque at the horn, and worn gears pass on less of the motor's
    # torque.
    most = servo.drive.headroom / (1 - servo.friction.motor_load) * needed
    ceiling, cruise = np.minimum(most, servo.motor_torque)
    cruise = np.minimum(cruise + servo.drive.room * servo.motor_torque, ceiling)

    def error(torque: Array) -> Steps:
        fine: Steps = np.rint(torque / servo.stiffness / step * FINE).astype(np.int64)
        return fine

    return Demand(
        ceiling,
        cruise,
        int(profile.ramp.max()) + EASES_AFTER,
        Loading(
            offset=(origin - start) * direction * FINE,
            begin=error(gravity[0]) * direction,
            end=error(gravity[-1]) * direction,
            # With a D gain, the duty also depends on the speed, so no single position error marks
            # its limit.
            most=UNLOADED.most if servo.control_damping else error(ceiling),
        ),
    )


def _needed(robot: Robot, profile: Profile, along: Array, inertia: Array) -> Array:
    """Return the greatest torque that motors need in the whole move, and after they have sped up.

    The result, (2, 8) N·m, is the stall torque at the needed duty. ``along``, (9, 8) N·m, is the
    torque of gravity against the motion at nine points of the path; ``inertia``, (9, 8) kg·m², is
    the moving inertia there.
    """
    servo, step, ramp = robot.servo.model, robot.servo.step, robot.servo.acceleration
    moves = (profile.distance != 0) | (profile.initial != 0)
    fastest = np.where(moves, profile.fastest, 0) * step / FINE
    # A motor at rest must hold its load while the others accelerate, whichever way gravity pulls.
    against = np.where(moves, along, np.abs(along))
    # A motor accelerates over the first part of its path, rounded up to the next of the nine
    # points, and slows down over the last part.
    way = np.where(profile.distance != 0, np.abs(profile.distance) * step, 1.0)
    part = fastest**2 / (2 * ramp) / way
    rises = _SHARES[:, None] < part + _SHARES[1]
    after = _SHARES[:, None] > part - _SHARES[1]
    # A motor that already moves may accelerate or slow down anywhere on its path.
    under_way = profile.initial != 0
    rises, after = rises | under_way, after | under_way
    accelerations = np.array([0.0, ramp, -ramp])[:, None, None]
    torques = required_torque(servo, fastest, accelerations, against, inertia)
    falls, never = rises[::-1], np.zeros_like(rises)
    looked_at = np.array([[np.ones_like(rises), rises, falls], [after, never, falls]])
    most: Array = np.max(
        np.broadcast_to(torques, looked_at.shape), axis=(1, 2), where=looked_at, initial=0.0
    )
    return most
