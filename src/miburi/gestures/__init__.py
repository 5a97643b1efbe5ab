"""Gestures: one TOML file per movement function, and the code that gives them mood and time."""

from miburi.gestures.movement import FEELINGS, MovementFunction, load
from miburi.gestures.performance import KeyPose, blend, breath, key_poses, membership

__all__ = [
    "FEELINGS",
    "KeyPose",
    "MovementFunction",
    "blend",
    "breath",
    "key_poses",
    "load",
    "membership",
]
