"""What servos are told beside a move: goals above the sag, and a ceiling for their push.

A position control without an integral is a spring: a motor hangs below its goal by its load over
its stiffness. The load is known from the description, so goals are aimed so much higher. And as
it is known what a move takes, the duty (Goal PWM) is limited to somewhat more: what then holds a
motor feels no more than that, whatever else fails.
"""

import numpy as np

from miburi.robot import Array, Robot
from miburi.robot.loads import loads
from miburi.servos import required_torque


def aim(robot: Robot, angles: Array) -> Array:
    """Return the goals at which loaded motors come to ``angles``, within the limits.

    Both are (..., 8) rad.
    """
    servo = robot.servo.model
    lifted = angles + servo.drive.lift / servo.stiffness * loads(robot, angles).gravity
    goals: Array = np.clip(lifted, np.minimum(robot.lower, angles), np.maximum(robot.upper, angles))
    return goals


def ceiling(robot: Robot, start: Array, end: Array, fastest: Array) -> Array:
    """Return the most that motors may give on a move, (8,): N·m of a motor at rest with that duty.

    Parameters
    ----------
    start, end
        (8,) rad.
    fastest
        (8,) rad/s that the motors come to on the way.
    """
    servo = robot.servo.model
    there = loads(robot, np.array([start, (start + end) / 2, end]))
    gravity, inertia = np.abs(there.gravity).max(axis=0), there.inertia.max(axis=0)
    # A motor that rests must hold out while the others ramp.
    needed = required_torque(servo, fastest, robot.servo.acceleration, gravity, inertia)
    return np.minimum(servo.drive.headroom * needed, servo.motor_torque)
