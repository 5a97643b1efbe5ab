"""Gestures: one TOML file per movement function, and the code that gives them mood and time."""

from miburi.gestures.movement import FEELINGS, MovementFunction, load
from miburi.gestures.performance import Beat, KeyPose, beats, key_pose, key_poses

__all__ = [
    "FEELINGS",
    "Beat",
    "KeyPose",
    "MovementFunction",
    "beats",
    "key_pose",
    "key_poses",
    "load",
]
