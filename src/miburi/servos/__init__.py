"""Servos: constants with their sources, and a model in the voltage domain.

A servo is a TOML file; :func:`load_servo` reads one that ships with Miburi by its name, or your own
by its path. The package is independent of robots; angles, speeds and torques are at the horn.
"""

from miburi.servos.axis import Axis
from miburi.servos.servo import SERVOS, Servo, load_servo
from miburi.servos.voltage import dry_friction, no_load_speed, required_torque, stall_torque

__all__ = [
    "SERVOS",
    "Axis",
    "Servo",
    "dry_friction",
    "load_servo",
    "no_load_speed",
    "required_torque",
    "stall_torque",
]
