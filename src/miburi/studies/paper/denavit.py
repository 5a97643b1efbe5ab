"""The Denavit-Hartenberg table of the body in Figs. 2 and 3; the paper does not print the table.

:data:`TABLES` has a chain for each extremity. Each row is a rotation about z by ``sign`` · angle +
``offset``, a translation of ``d`` along z and of ``a`` along the new x, and a rotation about the
new x by ``tilt`` (the classic convention). The rows are ours; a test checks them against
:func:`miburi.robot.forward`.
"""

from dataclasses import dataclass

import numpy as np

from miburi.robot import JOINTS, Array, Robot

_QUARTER = np.pi / 2


@dataclass(frozen=True)
class Row:
    """One row of a table; ``d`` and ``a`` each name the robot's lengths that are added up."""

    joint: str
    sign: int
    offset: float
    d: tuple[str, ...]
    a: tuple[str, ...]
    tilt: float


TABLES: dict[str, tuple[Row, ...]] = {
    "right": (
        Row("waist", 1, 0.0, ("L01",), (), _QUARTER),
        Row("right_shoulder", 1, _QUARTER, ("L12",), (), _QUARTER),
        Row("right_elbow", 1, _QUARTER, (), ("L23",), 0.0),
        Row("right_fingertip", 1, 0.0, (), ("L34",), 0.0),
    ),
    "left": (
        Row("waist", 1, 0.0, ("L01",), (), -_QUARTER),
        Row("left_shoulder", -1, -_QUARTER, ("L12",), (), _QUARTER),
        Row("left_elbow", -1, _QUARTER, (), ("L23",), 0.0),
        Row("left_fingertip", -1, 0.0, (), ("L34",), 0.0),
    ),
    "head": (
        Row("waist", 1, 0.0, ("L01", "LH1"), (), _QUARTER),
        Row("head", 1, 0.0, (), ("LH2",), 0.0),
    ),
}


def frames(robot: Robot, extremity: str, angles: Array) -> Array:
    """Return the frames of a chain from the base to the extremity, (k + 1, 4, 4), in m.

    ``angles``, (8,) in rad, are in the order of ``JOINTS``.
    """
    frame, found = np.eye(4), [np.eye(4)]
    for row in TABLES[extremity]:
        theta = row.sign * angles[JOINTS.index(row.joint)] + row.offset
        d, a = (sum(getattr(robot.lengths, name) for name in part) for part in (row.d, row.a))
        (cos, sin), (ct, st) = (np.cos(theta), np.sin(theta)), (np.cos(row.tilt), np.sin(row.tilt))
        frame = frame @ np.array(
            [
                [cos, -sin * ct, sin * st, a * cos],
                [sin, cos * ct, -cos * st, a * sin],
                [0.0, st, ct, d],
                [0.0, 0.0, 0.0, 1.0],
            ]
        )
        found.append(frame)
    return np.array(found)
