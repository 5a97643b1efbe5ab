"""Search over the waist's angle, the only unknown: it determines the best angles of arms and head.

It takes a body and a work record with its target, and writes the best pose of all into the record.
This is ours, not the paper's. Importing this module loads Numba.
"""

from math import atan2, pi, sqrt
from typing import NamedTuple

import numpy as np

from miburi.ground.compiled import compiled
from miburi.ik.limbs import nearest_angle, place_body
from miburi.ik.problem import Body, Work
from miburi.robot import Array

#: The width, in rad, of the finest cells into which the waist's range is cut, and how many of the
#: finest cells make up one of the coarsest.
_CELL, _HALVES = 0.01, 32
#: The search for a minimum ends at the latest when its cell is no wider than this, in rad.
_FINE = 1e-9


class Waist(NamedTuple):
    """An angle of the waist, and the best pose with it."""

    angle: float  # rad
    value: float  # Eq. 13
    slope: float  # its derivative with respect to the angle


@compiled
def search_waist(body: Body, work: Work) -> None:
    """Find the best pose of all.

    For a target in reach, the head alone determines the waist. Otherwise the waist's range is cut
    into cells, and these are halved down to ``_CELL``, except where a cell cannot hold anything
    below the best value known. A cell holds a minimum if, at its end with the lower value, Eq. 13
    falls towards the inside. Each of the finest cells that holds a minimum is then searched.
    """
    low, high = body.lower[0], body.upper[0]
    bearing = atan2(work.target[7], work.target[6])
    for turn in (0.0, pi):
        _visit(body, work, nearest_angle(bearing + turn, low, high))
        if work.value <= body.enough:
            return
    count = _HALVES * (int((high - low) / (_CELL * _HALVES)) + 1) + 1
    # waist angles from one limit to the other, each row a Waist; unknown values are infinite
    waists, fastest = np.empty((count, 3)), _fastest(body, work)
    for k in range(count):
        waists[k, 0], waists[k, 1] = low + (high - low) * (k / (count - 1)), np.inf
    for k in range(0, count, _HALVES):
        _explore(body, work, waists[k])
    width = _HALVES
    while width > 1:
        half = width // 2
        for k in range(half, count, width):
            if _promises(waists[k - half], waists[k + half], fastest, work):
                _explore(body, work, waists[k])
        width = half
    for k in range(count - 1):
        left, right = waists[k], waists[k + 1]
        if _promises(left, right, fastest, work) and _falls_inwards(left, right):
            lower, upper = Waist(left[0], left[1], left[2]), Waist(right[0], right[1], right[2])
            _search_cell(body, work, lower, upper)


@compiled
def _visit(body: Body, work: Work, angle: float) -> Waist:
    """Call :func:`place_body`, count it, and keep the pose if it is the best so far."""
    value, slope = place_body(body, work, angle)
    work.evaluations += 1
    if value < work.value:
        work.value = value
        for j in range(8):
            work.best[j] = work.new[j]
    return Waist(angle, value, slope)


@compiled
def _explore(body: Body, work: Work, waist: Array) -> None:
    found = _visit(body, work, waist[0])
    waist[1], waist[2] = found.value, found.slope


@compiled
def _fastest(body: Body, work: Work) -> float:
    """Return how fast the residual can change with the waist, in m/rad.

    For each radian that the waist turns, an extremity moves by its distance from the axis. Seen
    from the body, the extremity stays, and the target moves by the target's distance from the axis.
    The smaller of the two distances is the bound.
    """
    size, target = body.lengths, work.target
    total = 0.0
    for limb in range(3):
        circle = size.LH2 if limb == 2 else size.L12 + size.L23 + size.L34
        total += min(circle**2, target[3 * limb] ** 2 + target[3 * limb + 1] ** 2)
    fastest: float = sqrt(total)
    return fastest


@compiled
def _promises(left: Array, right: Array, fastest: float, work: Work) -> bool:
    """Whether both ends of a cell are known, and something better may lie between them."""
    if left[1] == np.inf or right[1] == np.inf:
        return False
    least = 0.5 * (sqrt(left[1]) + sqrt(right[1]) - fastest * (right[0] - left[0]))
    promises: bool = least < sqrt(work.value)
    return promises


@compiled
def _falls_inwards(left: Array, right: Array) -> bool:
    """Whether Eq. 13 falls inwards from the end with the lower value, so there is a minimum."""
    return bool(left[2] < 0.0 if left[1] < right[1] else right[2] > 0.0)


@compiled
def _search_cell(body: Body, work: Work, left: Waist, right: Waist) -> None:
    """Find the minimum in a cell, and a second one if there is one.

    There is a second minimum if, halfway from the first to an end, the objective falls towards that
    end.
    """
    floor = _descend(body, work, left, right)
    halfway = _visit(body, work, 0.5 * (left.angle + floor))
    if halfway.slope > 0.0:
        _descend(body, work, left, halfway)
    halfway = _visit(body, work, 0.5 * (floor + right.angle))
    if halfway.slope < 0.0:
        _descend(body, work, halfway, right)


@compiled
def _descend(body: Body, work: Work, left: Waist, right: Waist) -> float:
    """Find a minimum, where the slope is 0; return the waist's angle there.

    While Eq. 13 falls at the left end and rises at the right, the next point is chosen by regula
    falsi (Illinois). Otherwise, and every third time, it is the middle of the cell. Where a cell
    holds two minima, the side with the lower end is kept. The search stops once the possible gain,
    at most slope times width, is under 1 % of the smallest gain that matters.
    """
    falls, rises = left.slope, right.slope
    turn, gain = 0, np.inf
    angle = 0.5 * (left.angle + right.angle)
    while right.angle - left.angle > _FINE and gain > 0.01 * sqrt(body.enough * work.value):
        turn += 1
        angle = 0.5 * (left.angle + right.angle)
        if falls < 0.0 < rises and turn % 3 > 0:
            angle = (left.angle * rises - right.angle * falls) / (rises - falls)
        new = _visit(body, work, angle)
        to_the_right = new.slope < 0.0
        if new.value > min(left.value, right.value):
            to_the_right = right.value < left.value
        else:
            gain = abs(new.slope) * (right.angle - left.angle)
        if to_the_right:
            left, falls, rises = new, new.slope, 0.5 * rises
        else:
            right, rises, falls = new, new.slope, 0.5 * falls
    return angle
