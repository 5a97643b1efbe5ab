"""Movements that somebody can ask for by name: "lift your arms", "wave", "nod"."""

import tomllib
from functools import cache
from importlib import resources
from typing import Any

from miburi.feelings import FEELINGS
from miburi.gestures import KeyPose, MovementFunction, key_poses
from miburi.robot import Robot

_TABLE: dict[str, dict[str, Any]] = tomllib.loads(
    (resources.files(__package__) / "moves.toml").read_text(encoding="utf-8")
)
#: The names of the moves.
MOVES = tuple(_TABLE)


@cache
def _function(name: str) -> MovementFunction:
    # The feeling is only a placeholder: a move shows none.
    effort = {"space": 1.0, "weight": 0.4, "time": 0.4, "flow": 0.6}
    usual = {"name": name, "feeling": FEELINGS[0], "effort": effort}
    return MovementFunction.model_validate(usual | _TABLE[name])


def move(robot: Robot, name: str) -> list[KeyPose]:
    """Return the key poses of one of the ``MOVES``, from neutral to neutral."""
    return key_poses(robot, _function(name), 1.0)
