"""Gestures: turn a feeling's movement function (a TOML file) and a mood into timed key poses."""

from miburi.gestures.movement import MovementFunction, load, load_for, misfits
from miburi.gestures.posing import (
    BEAT_LEAD,
    Direction,
    KeyPose,
    beat,
    blend,
    key_pose,
    key_poses,
    look,
    membership,
    turned,
)
from miburi.gestures.repertoire import (
    Repertoire,
    read_repertoire,
    shipped_functions,
    shipped_repertoire,
)

__all__ = [
    "BEAT_LEAD",
    "Direction",
    "KeyPose",
    "MovementFunction",
    "Repertoire",
    "beat",
    "blend",
    "key_pose",
    "key_poses",
    "load",
    "load_for",
    "look",
    "membership",
    "misfits",
    "read_repertoire",
    "shipped_functions",
    "shipped_repertoire",
    "turned",
]
