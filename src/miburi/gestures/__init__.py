"""Gestures: one TOML file per movement function, and the code that gives them mood and time."""

from miburi.gestures.movement import MovementFunction, load, load_for, misfits
from miburi.gestures.performance import KeyPose, blend, breath, key_poses, membership
from miburi.gestures.repertoire import Repertoire, read_repertoire, shipped

__all__ = [
    "KeyPose",
    "MovementFunction",
    "Repertoire",
    "blend",
    "breath",
    "key_poses",
    "load",
    "load_for",
    "membership",
    "misfits",
    "read_repertoire",
    "shipped",
]
