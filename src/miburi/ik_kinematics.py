"""The body's kinematics, compiled for the search: Eq. 13 whole, linearised, or changed in a joint.

Each limb's coordinates are taken in a frame that turns with the waist (out of the shoulder,
forward, up): lengths of errors, and so Eq. 13, do not depend on the frame. Importing this module
loads Numba.
"""

from math import atan2, cos, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from miburi.bma_operators import Array
from miburi.compiled import compiled


class Body(NamedTuple):
    """The six lengths of Section 3, (6,) m, and Table 1, (8,) rad each."""

    lengths: Array
    lower: Array
    upper: Array


class Pose(NamedTuple):
    """What is known of one pose, so that a change of one joint costs little."""

    turned: Array  # (3, 3) m, the targets right, left, head: out of the shoulder, forward, up
    arms: Array  # (2, 6): out of the shoulder, off its axis, sin S, cos S, the same two of L23
    errors: Array  # (3,) m², the squared error of each limb


@compiled
def known_pose() -> Pose:
    """Return the memory for one pose."""
    return Pose(np.empty((3, 3)), np.empty((2, 6)), np.empty(3))


@compiled
def know(lengths: Array, target: Array, q: Array, pose: Pose) -> float:
    """Write all that is known of the pose ``q``; return Eq. 13."""
    sw, cw = sin(q[0]), cos(q[0])
    for limb in range(3):
        side = -1.0 if limb else 1.0
        pose.turned[limb, 0] = side * (target[3 * limb] * sw - target[3 * limb + 1] * cw)
        pose.turned[limb, 1] = target[3 * limb] * cw + target[3 * limb + 1] * sw
        pose.turned[limb, 2] = target[3 * limb + 2]
    for limb in range(2):
        side = -1.0 if limb else 1.0
        s, e, f = q[1 + 3 * limb], side * q[2 + 3 * limb], side * q[3 + 3 * limb]
        arm = pose.arms[limb]
        arm[2], arm[3] = sin(s), cos(s)
        arm[4], arm[5] = lengths[1] + lengths[2] * cos(e), lengths[2] * sin(e)
        arm[0], arm[1] = arm[4] + lengths[3] * cos(e + f), arm[5] + lengths[3] * sin(e + f)
        pose.errors[limb] = _arm_error(lengths, pose.turned[limb], arm[0], arm[1], arm[2], arm[3])
    pose.errors[2] = _head_error(lengths, pose.turned[2], q[7])
    total: float = pose.errors[0] + pose.errors[1] + pose.errors[2]
    return total


@compiled
def changed(lengths: Array, target: Array, q: Array, joint: int, pose: Pose) -> float:
    """Return Eq. 13 for a pose that differs in one joint from the known one."""
    if joint == 0:
        return _turned_error(lengths, target, q, pose)
    if joint == 7:
        head: float = pose.errors[0] + pose.errors[1] + _head_error(lengths, pose.turned[2], q[7])
        return head
    limb = 0 if joint < 4 else 1
    side = -1.0 if limb else 1.0
    first = 1 + 3 * limb
    arm = pose.arms[limb]
    along, out, ss, cs = arm[0], arm[1], arm[2], arm[3]
    if joint == first:
        ss, cs = sin(q[first]), cos(q[first])
    else:
        e, f = side * q[first + 1], side * q[first + 2]
        along, out = arm[4], arm[5]
        if joint == first + 1:
            along, out = lengths[1] + lengths[2] * cos(e), lengths[2] * sin(e)
        along += lengths[3] * cos(e + f)
        out += lengths[3] * sin(e + f)
    total: float = pose.errors[1 - limb] + pose.errors[2]
    return total + _arm_error(lengths, pose.turned[limb], along, out, ss, cs)


@compiled
def _turned_error(lengths: Array, target: Array, q: Array, pose: Pose) -> float:
    """Return Eq. 13 with another waist angle."""
    sw, cw = sin(q[0]), cos(q[0])
    total: float = 0.0
    for limb in range(2):
        side = -1.0 if limb else 1.0
        x, y = target[3 * limb], target[3 * limb + 1]
        arm = pose.arms[limb]
        total += (arm[0] - side * (x * sw - y * cw)) ** 2
        total += (arm[1] * arm[2] - (x * cw + y * sw)) ** 2
        total += (lengths[0] - arm[1] * arm[3] - target[3 * limb + 2]) ** 2
    rise = lengths[5] * sin(q[7]) + lengths[0] + lengths[4] - target[8]
    total += (lengths[5] * cos(q[7]) - (target[6] * cw + target[7] * sw)) ** 2 + rise * rise
    total += (target[6] * sw - target[7] * cw) ** 2
    return total


@compiled
def _arm_error(
    lengths: Array, there: Array, along: float, out: float, ss: float, cs: float
) -> float:
    ahead, above = out * ss - there[1], lengths[0] - out * cs - there[2]
    error: float = (along - there[0]) ** 2 + ahead * ahead + above * above
    return error


@compiled
def _head_error(lengths: Array, there: Array, nod: float) -> float:
    above = lengths[0] + lengths[4] + lengths[5] * sin(nod) - there[2]
    error: float = there[0] ** 2 + (lengths[5] * cos(nod) - there[1]) ** 2 + above * above
    return error


@compiled
def linearise(lengths: Array, target: Array, q: Array, normal: Array, gradient: Array) -> float:
    """Write JᵀJ (its lower triangle) and the gradient of Eq. 13, 2 Jᵀe; return Eq. 13.

    ``normal`` must come with zeros where no joint of one limb meets one of another.
    """
    sw, cw = sin(q[0]), cos(q[0])
    reach, rise = lengths[5] * cos(q[7]), lengths[5] * sin(q[7])
    ahead = reach - (target[6] * cw + target[7] * sw)
    aside = target[6] * sw - target[7] * cw
    above = lengths[0] + lengths[4] + rise - target[8]
    normal[0, 0] = reach * reach
    normal[7, 7] = reach * reach + rise * rise
    gradient[0] = 2.0 * reach * aside
    gradient[7] = 2.0 * (reach * above - rise * ahead)
    total: float = ahead * ahead + aside * aside + above * above
    total += _add_arm(
        lengths,
        target[0] * sw - target[1] * cw,
        target[0] * cw + target[1] * sw,
        target[2],
        q,
        1,
        1.0,
        normal,
        gradient,
    )
    total += _add_arm(
        lengths,
        target[4] * cw - target[3] * sw,
        target[3] * cw + target[4] * sw,
        target[5],
        q,
        4,
        -1.0,
        normal,
        gradient,
    )
    return total


@compiled
def _add_arm(
    lengths: Array,
    out_there: float,
    forward_there: float,
    up_there: float,
    q: Array,
    first: int,
    side: float,
    normal: Array,
    gradient: Array,
) -> float:
    """Write an arm's part of JᵀJ and 2 Jᵀe, add its part for the waist; return its part of Eq. 13.

    A column of J holds the hand's velocity sideways, forward and up, for the waist (w), the
    shoulder (s), the elbow (e) or the fingertip (f).
    """
    e, f = side * q[first + 1], side * q[first + 2]
    ss, cs, se, ce = sin(q[first]), cos(q[first]), sin(e), cos(e)
    sef, cef = lengths[3] * sin(e + f), lengths[3] * cos(e + f)
    along, out = lengths[1] + lengths[2] * ce + cef, lengths[2] * se + sef
    aside, ahead = along - out_there, out * ss - forward_there
    above = lengths[0] - out * cs - up_there
    w_aside, w_ahead = -side * out * ss, side * along
    s_ahead, s_above = out * cs, out * ss
    f_aside, f_swing = -side * sef, side * cef
    e_aside, e_swing = f_aside - side * lengths[2] * se, f_swing + side * lengths[2] * ce
    e_ahead, e_above, f_ahead, f_above = e_swing * ss, -e_swing * cs, f_swing * ss, -f_swing * cs
    normal[0, 0] += w_aside * w_aside + w_ahead * w_ahead
    normal[first, 0] = s_ahead * w_ahead
    normal[first + 1, 0] = e_aside * w_aside + e_ahead * w_ahead
    normal[first + 2, 0] = f_aside * w_aside + f_ahead * w_ahead
    normal[first, first] = s_ahead * s_ahead + s_above * s_above
    normal[first + 1, first] = e_ahead * s_ahead + e_above * s_above
    normal[first + 2, first] = f_ahead * s_ahead + f_above * s_above
    normal[first + 1, first + 1] = e_aside * e_aside + e_swing * e_swing
    normal[first + 2, first + 1] = f_aside * e_aside + f_swing * e_swing
    normal[first + 2, first + 2] = f_aside * f_aside + f_swing * f_swing
    gradient[0] += 2.0 * (w_aside * aside + w_ahead * ahead)
    gradient[first] = 2.0 * (s_ahead * ahead + s_above * above)
    gradient[first + 1] = 2.0 * (e_aside * aside + e_ahead * ahead + e_above * above)
    gradient[first + 2] = 2.0 * (f_aside * aside + f_ahead * ahead + f_above * above)
    error: float = aside * aside + ahead * ahead + above * above
    return error


@compiled
def finish(
    lengths: Array,
    lower: Array,
    upper: Array,
    target: Array,
    start: Array,
    has_start: bool,
    pose: Array,
    found: Array,
) -> float:
    """Choose the pose nearest to ``start``; write pose and errors, (11,); return the residual."""
    if has_start:
        _nearest_arm(lower, upper, lengths, start, pose, 1, 1.0)
        _nearest_arm(lower, upper, lengths, start, pose, 4, -1.0)
    known = known_pose()
    total = know(lengths, target, pose, known)
    for j in range(8):
        found[j] = pose[j]
    for limb in range(3):
        found[8 + limb] = sqrt(known.errors[limb])
    return sqrt(total)


@compiled
def _nearest_arm(
    lower: Array, upper: Array, lengths: Array, start: Array, q: Array, first: int, side: float
) -> None:
    """Replace an arm's pose by that one of the same hand position which is nearest to ``start``.

    The elbow mirrored about the line to the hand, the shoulder turned by π, and both: no other
    pose of an arm, with the waist where it is, puts the hand on the same point. With the hand on
    the shoulder axis any shoulder angle will do.
    """
    s, e, f = q[first], side * q[first + 1], side * q[first + 2]
    reach = lengths[2] * cos(e) + lengths[3] * cos(e + f)
    out = lengths[2] * sin(e) + lengths[3] * sin(e + f)
    bearing = atan2(out, reach)
    on_axis = abs(out) < 1e-9
    shortest = np.inf
    found, arm = np.empty(3), np.empty(3)
    for turn in (0.0, pi, -pi):
        sign = 1.0 if turn == 0.0 else -1.0
        for mirror in (1.0, -1.0):
            arm[0] = s + turn
            if on_axis:
                arm[0] = min(max(start[first], lower[first]), upper[first])
            arm[1] = side * sign * (e if mirror > 0 else _wrapped(2 * bearing - e))
            arm[2] = side * sign * mirror * f
            distance = 0.0
            for k in range(3):
                distance += (arm[k] - start[first + k]) ** 2
                if arm[k] < lower[first + k] or arm[k] > upper[first + k]:
                    distance = np.inf
            if distance < shortest:
                shortest = distance
                for k in range(3):
                    found[k] = arm[k]
    if shortest < np.inf:
        for k in range(3):
            q[first + k] = found[k]


@compiled
def _wrapped(angle: float) -> float:
    return (angle + pi) % (2 * pi) - pi
