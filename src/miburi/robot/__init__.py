"""The robot: its description, forward kinematics and closed-form inverse."""

from miburi.robot.closed_form import inverse
from miburi.robot.description import (
    EXTREMITIES,
    JOINTS,
    Array,
    Robot,
    buildable,
    iphonoid,
    load_robot,
)
from miburi.robot.kinematics import forward, jacobian
from miburi.robot.printed import forward_as_printed

__all__ = [
    "EXTREMITIES",
    "JOINTS",
    "Array",
    "Robot",
    "buildable",
    "forward",
    "forward_as_printed",
    "inverse",
    "iphonoid",
    "jacobian",
    "load_robot",
]
