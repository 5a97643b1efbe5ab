"""Checksums of what guards depend on, to tell whether a robot is the one that they were made for.

Guards fit one body: its lengths, masses, joint limits and servos. Names do not tell, since people
change a robot's file and keep its name.
"""

import json
from hashlib import sha256

from miburi.robot.description import Robot

#: The parts of a description that guards depend on, by their tables, in words.
PARTS = {
    "lengths": "lengths",
    "masses": "masses",
    "joints": "joint limits",
    "servo": "servo's constants or speeds",
}
_NOT_PHYSICAL = {"name", "standing", "source", "symbol", "data_sheet"}


def checksums(robot: Robot) -> dict[str, str]:
    """Return a checksum of each part in ``PARTS``; names and sources do not change it."""
    content = robot.model_dump()
    servo = content["servo"]
    del servo["hold_torque"]  # for a stopped body, which has no guards
    # Of how the servo is driven, only the gain; trials switch off the rest.
    servo["model"]["drive"] = servo["model"]["drive"]["gain"]
    return {part: checksum(content[part]) for part in PARTS}


def differing(one: dict[str, str], other: dict[str, str]) -> str:
    """Return the parts whose checksums differ, in words, such as ``lengths and masses``."""
    *most, last = ["", *(words for part, words in PARTS.items() if one[part] != other[part])]
    return " and ".join(filter(None, [", ".join(most[1:]), last]))


def checksum(values: object) -> str:
    """Return a checksum of a table's values; its name and its sources do not change it."""
    return sha256(json.dumps(_physical(values)).encode()).hexdigest()[:12]


def _physical(values: object) -> object:
    if not isinstance(values, dict):
        return float(values) if isinstance(values, int) else values
    return {key: _physical(values[key]) for key in sorted(values) if key not in _NOT_PHYSICAL}
