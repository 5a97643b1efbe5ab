"""Each limb alone: for a given waist angle, the best angles of arms and head are known exactly.

The module takes a body, a work record with its target, and a waist angle, and returns the best pose
at that angle with the value of Eq. 13, the paper's objective. What remains is a search over one
angle, which finds the best pose even for a target out of reach. This method is ours, not the
paper's. Importing this module loads Numba.
"""

from math import acos, atan2, cos, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from miburi.ground.compiled import compiled
from miburi.ik.problem import Body, Work
from miburi.robot import Array

#: An angle outside a limit by at most this, in rad, is set to the limit. A hand counts as being on
#: the shoulder's axis if its distance from the axis is below this share of the arm's length.
_SLIGHT = 1e-9


class _Planar(NamedTuple):
    """An arm in its own plane: lengths, and limits of elbow and fingertip (positive inwards)."""

    upper: float  # m
    fore: float  # m
    e_low: float
    e_high: float
    f_low: float
    f_high: float


@compiled
def nearest_angle(angle: float, low: float, high: float) -> float:
    """Return the angle from ``low`` to ``high`` whose direction is nearest to that of ``angle``."""
    middle = 0.5 * (low + high)
    nearest: float = min(max(middle + _wrapped(angle - middle), low), high)
    return nearest


@compiled
def _wrapped(angle: float) -> float:
    """Return the same direction as an angle from -π to π."""
    direction: float = angle - 2.0 * pi * np.rint(angle / (2.0 * pi))
    return direction


@compiled
def place_body(body: Body, work: Work, waist: float) -> tuple[float, float]:
    """Write the best pose for this waist to ``new``; return Eq. 13 and its slope over the waist.

    The other joints are optimal, so their motion adds nothing to the derivative.
    """
    sine, cosine = sin(waist), cos(waist)
    target, pose = work.target, work.new
    pose[0] = waist
    size, lower, upper = body.lengths, body.lower, body.upper
    ahead = target[6] * cosine + target[7] * sine
    aside = target[6] * sine - target[7] * cosine
    rise = target[8] - size.L01 - size.LH1
    pose[7] = nearest_angle(atan2(rise, ahead), lower[7], upper[7])
    nod_sine, nod_cosine = sin(pose[7]), cos(pose[7])
    reach = size.LH2 * nod_cosine
    value = (reach - ahead) ** 2 + (size.LH2 * nod_sine - rise) ** 2 + aside**2
    slope = 2.0 * reach * aside
    right, right_slope = _place_arm(body, work, 0, sine, cosine)
    left, left_slope = _place_arm(body, work, 1, sine, cosine)
    return value + right + left, slope + right_slope + left_slope


@compiled
def _place_arm(
    body: Body, work: Work, limb: int, sine: float, cosine: float
) -> tuple[float, float]:
    """Write the best angles of an arm (0: right, 1: left); return its error and the slope.

    With the shoulder fixed, the arm moves in a plane. In that plane the hand can be on either side
    of the shoulder's axis, so there are two candidate shoulder angles.
    """
    size, lower, upper = body.lengths, body.lower, body.upper
    target, pose = work.target, work.new
    side, first = (-1.0, 4) if limb else (1.0, 1)
    x, y = target[3 * limb], target[3 * limb + 1]
    along = side * (x * sine - y * cosine) - size.L12
    ahead = x * cosine + y * sine
    above = target[3 * limb + 2] - size.L01
    if side > 0.0:
        arm = _Planar(size.L23, size.L34, lower[2], upper[2], lower[3], upper[3])
    else:
        arm = _Planar(size.L23, size.L34, -upper[5], -lower[5], -upper[6], -lower[6])
    away = sqrt(along * along + ahead * ahead + above * above)
    gap = max(away - arm.upper - arm.fore, abs(arm.upper - arm.fore) - away, 0.0)
    least = gap * gap * (1.0 + 1e-12) + 1e-26  # no pose does better
    towards = atan2(ahead, -above)
    error = np.inf
    slope = 0.0
    for turn in (0.0, pi):
        shoulder = nearest_angle(towards + turn, lower[first], upper[first])
        ss, cs = sin(shoulder), cos(shoulder)
        out = ahead * ss - above * cs
        across = ahead * cs + above * ss
        across *= across
        away = sqrt(along * along + out * out)
        gap = max(away - arm.upper - arm.fore, abs(arm.upper - arm.fore) - away, 0.0)
        if across + gap * gap >= error:
            continue
        elbow, fingertip, tip_along, tip_out, missed = _place_planar(
            arm, along, out, least - across
        )
        if missed + across < error:
            error = missed + across
            pose[first], pose[first + 1], pose[first + 2] = shoulder, side * elbow, side * fingertip
            swing = tip_out * ss
            slope = (size.L12 + tip_along) * (swing - ahead) - swing * (tip_along - along)
            slope *= 2.0 * side
            if error <= least:
                break
    return error, slope


@compiled
def _place_planar(
    arm: _Planar, x: float, y: float, least: float
) -> tuple[float, float, float, float, float]:
    """Return elbow, fingertip, tip x, tip y and the least squared distance of the tip from (x, y).

    At the best pose either the fingertip is at a limit, or it is bent inwards or outwards to match
    the distance, or the elbow is at a limit. In each case the other joint's angle follows. The
    search ends early once it reaches ``least``.
    """
    a, b = arm.upper, arm.fore
    bent = acos(min(max((x * x + y * y - a * a - b * b) / (2.0 * a * b), -1.0), 1.0))
    bearing = atan2(y, x)
    best = (arm.e_low, arm.f_low, 0.0, 0.0, np.inf)
    for k in range(6):
        if k < 4:
            f = bent if k == 0 else -bent if k == 1 else arm.f_low if k == 2 else arm.f_high
            if f < arm.f_low or f > arm.f_high or (k == 1 and bent == 0.0):
                continue
            sf, cf = sin(f), cos(f)
            e = nearest_angle(bearing - atan2(b * sf, a + b * cf), arm.e_low, arm.e_high)
            se, ce = sin(e), cos(e)
        else:
            e = arm.e_low if k == 4 else arm.e_high
            se, ce = sin(e), cos(e)
            f = nearest_angle(atan2(y - a * se, x - a * ce) - e, arm.f_low, arm.f_high)
            sf, cf = sin(f), cos(f)
        tip_x = a * ce + b * (ce * cf - se * sf)
        tip_y = a * se + b * (se * cf + ce * sf)
        missed = (tip_x - x) ** 2 + (tip_y - y) ** 2
        if missed < best[4]:
            best = (e, f, tip_x, tip_y, missed)
            if missed <= least:
                break
    return best


@compiled
def choose_nearest(body: Body, work: Work, start: Array, pose: Array) -> None:
    """Of the poses that put hands and head on the same points, take the one nearest to ``start``.

    The arms choose among their own poses. With the waist turned by π, the head can reach the same
    point by nodding backwards; that pose is a candidate if its objective is at most ``enough``.
    """
    lower, upper, present, other = body.lower, body.upper, np.empty(8), np.empty(8)
    for j in range(8):
        present[j] = min(max(start[j], lower[j]), upper[j])
    if _is_nearest(present, pose):
        return
    distance = _choose_arms(body, present, pose)
    waist = nearest_angle(pose[0] + pi, lower[0], upper[0])
    nod = nearest_angle(pi - pose[7], lower[7], upper[7])
    if abs(_wrapped(waist - pose[0] - pi)) > _SLIGHT or abs(_wrapped(nod + pose[7] - pi)) > _SLIGHT:
        return
    value, _ = place_body(body, work, waist)
    for j in range(8):
        other[j] = work.new[j]
    if value <= body.enough and _choose_arms(body, present, other) < distance:
        for j in range(8):
            pose[j] = other[j]


@compiled
def _is_nearest(start: Array, pose: Array) -> bool:
    """Whether a pose is so near to ``start`` that no other with the same points can be nearer.

    The other poses turn the waist or a shoulder by π, or bend a fingertip just as far to the
    other side.
    """
    total = 0.0
    for j in range(8):
        total += (pose[j] - start[j]) ** 2
    near: bool = total <= min(pose[3] ** 2, pose[6] ** 2, 0.25 * pi * pi)
    return near


@compiled
def _choose_arms(body: Body, start: Array, pose: Array) -> float:
    """Let each arm take its pose nearest to ``start``; return the whole pose's squared distance."""
    distance: float = (pose[0] - start[0]) ** 2 + (pose[7] - start[7]) ** 2
    for first in (1, 4):
        distance += _choose_arm(body, start, pose, first)
    return distance


@compiled
def _choose_arm(body: Body, start: Array, q: Array, first: int) -> float:
    """Of the arm's poses with this hand position, take the one nearest to ``start``.

    With the same waist angle, only four poses put the hand on the same point: this one, the elbow
    mirrored about the line from shoulder to hand, the shoulder turned by π, and both together.
    With the hand on the shoulder axis any shoulder angle will do. Returns the squared distance.
    """
    size, lower, upper = body.lengths, body.lower, body.upper
    s, e, f = q[first], q[first + 1], q[first + 2]
    se, ce = sin(e), cos(e)
    sef, cef = sin(e + f), cos(e + f)
    out = size.L23 * se + size.L34 * sef
    bearing = atan2(out, size.L23 * ce + size.L34 * cef)
    half_turn = pi
    if abs(out) < _SLIGHT * (size.L23 + size.L34):
        s, half_turn = start[first], 0.0
    shortest = np.inf
    for side in (1.0, -1.0):
        shoulder = s if side > 0.0 else s + half_turn
        for mirror in (1.0, -1.0):
            elbow = side * (e if mirror > 0.0 else 2.0 * bearing - e)
            distance, outside = 0.0, 0.0
            for j, angle in enumerate((shoulder, elbow, side * mirror * f), first):
                allowed = nearest_angle(angle, lower[j], upper[j])
                outside = max(outside, abs(_wrapped(allowed - angle)))
                distance += (allowed - start[j]) ** 2
            if distance < shortest and (outside <= _SLIGHT or (side > 0.0 and mirror > 0.0)):
                shortest = distance
                for j, angle in enumerate((shoulder, elbow, side * mirror * f), first):
                    q[j] = nearest_angle(angle, lower[j], upper[j])
    return shortest
