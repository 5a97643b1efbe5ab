"""The nine coordinate errors of Eq. 13 and their derivatives, compiled.

The functions here take a body, a target and poses. They return the errors whose squares the memetic
algorithm minimises, or the derivatives of these errors. Importing this module loads Numba.
"""

from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from miburi.ground.compiled import compiled
from miburi.ik.problem import Body
from miburi.robot import Array


@compiled
def residuals(record: NDArray[np.void], target: Array, poses: Array) -> Array:
    """Return the errors of poses: of the right hand, the left hand and the head.

    Poses have shape (k, 8), in rad, and errors have shape (k, 9), in m.
    """
    body: Body = record[0]
    errors = np.empty((poses.shape[0], 9))
    for row in range(poses.shape[0]):
        note_errors(body, target, poses[row], errors[row])
    return errors


@compiled
def note_errors(body: Body, target: Array, q: Array, e: Array) -> None:
    """Write the nine errors, in m, of one pose, which has eight angles in rad."""
    size = body.lengths
    sw, cw = sin(q[0]), cos(q[0])
    for limb in range(2):
        side, first, k = (-1.0, 4, 3) if limb else (1.0, 1, 0)
        elbow, both = side * q[first + 1], side * (q[first + 1] + q[first + 2])
        along = side * (size.L12 + size.L23 * cos(elbow) + size.L34 * cos(both))
        out = size.L23 * sin(elbow) + size.L34 * sin(both)
        ahead = out * sin(q[first])
        e[k] = along * sw + ahead * cw - target[k]
        e[k + 1] = ahead * sw - along * cw - target[k + 1]
        e[k + 2] = size.L01 - out * cos(q[first]) - target[k + 2]
    reach = size.LH2 * cos(q[7])
    e[6] = reach * cw - target[6]
    e[7] = reach * sw - target[7]
    e[8] = size.L01 + size.LH1 + size.LH2 * sin(q[7]) - target[8]


@compiled
def jacobian(record: NDArray[np.void], q: Array) -> Array:
    """Return the derivatives of the errors at one pose, in m/rad, as an array (9, 8)."""
    size, rows = record[0].lengths, np.zeros((9, 8))
    sw, cw = sin(q[0]), cos(q[0])
    for limb in range(2):
        side, first, k = (-1.0, 4, 3) if limb else (1.0, 1, 0)
        ss, cs = sin(q[first]), cos(q[first])
        elbow, both = side * q[first + 1], side * (q[first + 1] + q[first + 2])
        along = side * (size.L12 + size.L23 * cos(elbow) + size.L34 * cos(both))
        out = size.L23 * sin(elbow) + size.L34 * sin(both)
        rows[k, 0] = along * cw - out * ss * sw
        rows[k + 1, 0] = along * sw + out * ss * cw
        rows[k, first], rows[k + 1, first] = out * cs * cw, out * cs * sw
        rows[k + 2, first] = out * ss
        aside, swing = -size.L34 * sin(both), side * size.L34 * cos(both)
        for joint in (first + 2, first + 1):
            rows[k, joint] = aside * sw + swing * ss * cw
            rows[k + 1, joint] = swing * ss * sw - aside * cw
            rows[k + 2, joint] = -swing * cs
            aside -= size.L23 * sin(elbow)
            swing += side * size.L23 * cos(elbow)
    reach = size.LH2 * cos(q[7])
    rows[6, 0], rows[7, 0] = -reach * sw, reach * cw
    swing = -size.LH2 * sin(q[7])
    rows[6, 7], rows[7, 7], rows[8, 7] = swing * cw, swing * sw, reach
    return rows
