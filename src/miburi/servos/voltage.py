"""The servo in the voltage domain: the torque of its motor, and the losses in its gears.

The position control sets a duty; the motor sees that share of the supply's voltage V::

    duty  = P/divisor · (error in steps) / 885, no more than its limit
    motor = kt/R · (duty · V − ke · w)
    horn  = motor − viscous · w − dry friction

The dry friction is model M6 of Better Actuator Models (Duclusaud and Passault,
arXiv:2410.08650) without its smallest terms: it grows with the motor's torque, and at rest also
with the load. Torques are in N·m, speeds in rad/s, all at the horn.
"""

from math import exp

import numpy as np
from numpy.typing import NDArray

from miburi.servos.servo import Servo

Array = NDArray[np.float64]
Numbers = Array | float


def dry_friction(
    dry: float,
    stiction: float,
    motor_load: float,
    load_stiction: float,
    stribeck_speed: float,
    stribeck_shape: float,
    motor: float,
    load: float,
    speed: float,
) -> float:
    """Return the bound of dry friction in N·m: the load that it can hold, and its drag on a motion.

    Parameters
    ----------
    dry, stiction, motor_load, load_stiction, stribeck_speed, stribeck_shape
        The constants: :attr:`miburi.servos.servo.Friction.row`.
    motor, load
        The motor's torque, and the outside torque on the horn.
    speed
        The joint's speed.
    """
    # math.exp is much quicker than NumPy's for one number.
    rest = exp(-((abs(speed) / stribeck_speed) ** stribeck_shape))
    at_rest = stiction + load_stiction * abs(load)
    return float(dry + motor_load * abs(motor) + rest * at_rest)


def stall_torque(servo: Servo, voltage: float) -> float:
    """Return the torque, in N·m, that a motor at rest gives at the horn at full duty."""
    friction = servo.friction
    motor = servo.motor_torque * voltage / servo.supply.voltage
    left = motor * (1 - friction.motor_load) - friction.dry - friction.stiction
    return left / (1 + friction.load_stiction)


def no_load_speed(servo: Servo, voltage: float) -> float:
    """Return the speed at full duty without a load, in rad/s.

    This speed is assumed to be well above the Stribeck speed. It is infinite if there is neither
    back EMF nor viscous friction.
    """
    friction = servo.friction
    gears = 1 - friction.motor_load
    motor = servo.motor_torque * voltage / servo.supply.voltage
    back = servo.damping - friction.viscous
    lost = gears * back + friction.viscous
    return (gears * motor - friction.dry) / lost if lost else float("inf")


def required_torque(
    servo: Servo, speed: Numbers, acceleration: Numbers, load: Numbers, inertia: Numbers
) -> Numbers:
    """Return the duty that a motion needs, given as the motor's stall torque at this duty, in N·m.

    Parameters
    ----------
    speed
        The motion's speed, in rad/s; not negative.
    acceleration
        The acceleration along the motion, in rad/s²; negative where the motion slows down.
    load, inertia
        The torque against the motion, in N·m, negative where it helps the motion; and the inertia
        on the horn, in kg·m², without the rotor's inertia, which comes from ``servo``.
    """
    friction = servo.friction
    rest = np.exp(-((speed / friction.stribeck_speed) ** friction.stribeck_shape))
    held = friction.dry + rest * (friction.stiction + friction.load_stiction * np.abs(load))
    pushed = load + (servo.motor.armature + inertia) * acceleration
    back = (servo.damping - friction.viscous) * speed
    gears = 1 - friction.motor_load
    driven = (pushed + friction.viscous * speed + held) / gears + back
    # Friction and back EMF help to slow a motion down; that help is left out.
    needed: Numbers = np.maximum(driven, -pushed / gears)
    return needed
