"""Each limb alone: with the waist at rest, the best angles of an arm or the head are known exactly.

In: a problem, a work with its target, and an angle of the waist. Out: a pose, and Eq. 13 there. A
search over one angle is left, which finds the best pose of a target out of reach. This is ours, not
the paper's, and the only part of the solver that knows more of the body than how to evaluate it.
Importing this module loads Numba.
"""

from math import acos, atan2, pi, sqrt
from typing import NamedTuple

import numpy as np

from miburi.bma.operators import Array
from miburi.ground.compiled import compiled
from miburi.ik.kinematics import better, sine_and_cosine
from miburi.ik.problem import Problem, Work

__all__ = [
    "Planar",
    "Waist",
    "Waists",
    "choose_nearest",
    "nearest_angle",
    "place_body",
    "point_body",
    "search_waist",
    "wrapped",
]

#: The finest cells of the waist, in rad, and how many of them make one of the first.
_CELL, _HALVES = 0.01, 32
#: A valley's floor is known at least as well as this, in rad.
_FINE = 1e-9
#: An angle this far outside a limit is put on it, in rad; a hand at this share of the arm from the
#: shoulder's axis is on it.
_SLIGHT = 1e-9


class Planar(NamedTuple):
    """An arm in its own plane: lengths, limits of elbow and fingertip, both positive inwards."""

    upper: float  # m
    fore: float  # m
    e_low: float
    e_high: float
    f_low: float
    f_high: float


@compiled
def nearest_angle(angle: float, low: float, high: float) -> float:
    """Return the allowed angle, low to high, whose direction is nearest to that of ``angle``."""
    middle = 0.5 * (low + high)
    nearest: float = min(max(middle + wrapped(angle - middle), low), high)
    return nearest


@compiled
def wrapped(angle: float) -> float:
    """Return the same direction as an angle from -π to π."""
    direction: float = angle - 2.0 * pi * np.rint(angle / (2.0 * pi))
    return direction


@compiled
def point_body(problem: Problem, work: Work, pose: Array) -> None:
    """Write a pose to begin at: head and shoulders point at their targets, the arms are half bent.

    Of a target in reach, waist and head are then right, and the shoulders mostly.
    """
    size, lower, upper, target = problem.size, problem.lower, problem.upper, work.target
    waist = nearest_angle(atan2(target[7], target[6]), lower[0], upper[0])
    sine, cosine = sine_and_cosine(waist)
    pose[0] = waist
    rise = target[8] - size.L01 - size.LH1
    ahead = target[6] * cosine + target[7] * sine
    pose[7] = nearest_angle(atan2(rise, ahead), lower[7], upper[7])
    for first in (1, 4):
        x, y, z = target[first - 1], target[first], target[first + 1]
        towards = atan2(x * cosine + y * sine, size.L01 - z)
        pose[first] = nearest_angle(towards, lower[first], upper[first])
        for j in (first + 1, first + 2):
            pose[j] = 0.5 * (lower[j] + upper[j])


@compiled
def place_body(problem: Problem, work: Work, waist: float) -> tuple[float, float]:
    """Write the best pose with this waist to ``new``; return Eq. 13 and its slope by the waist.

    The other joints are at their best, so that their motion adds nothing to the slope.
    """
    sine, cosine = sine_and_cosine(waist)
    target, pose = work.target, work.new
    pose[0] = waist
    size, lower, upper = problem.size, problem.lower, problem.upper
    ahead = target[6] * cosine + target[7] * sine
    aside = target[6] * sine - target[7] * cosine
    rise = target[8] - size.L01 - size.LH1
    pose[7] = nearest_angle(atan2(rise, ahead), lower[7], upper[7])
    nod_sine, nod_cosine = sine_and_cosine(pose[7])
    reach = size.LH2 * nod_cosine
    value = (reach - ahead) ** 2 + (size.LH2 * nod_sine - rise) ** 2 + aside**2
    slope = 2.0 * reach * aside
    right, right_slope = _place_arm(problem, work, 0, sine, cosine)
    left, left_slope = _place_arm(problem, work, 1, sine, cosine)
    return value + right + left, slope + right_slope + left_slope


@compiled
def _place_arm(
    problem: Problem, work: Work, limb: int, sine: float, cosine: float
) -> tuple[float, float]:
    """Write the best angles of an arm, 0 the right one, 1 the left; return error and slope.

    With the shoulder at rest the arm is a planar one. The hand is either on the side of the
    shoulder's axis to which the shoulder turns it, or on the other: so two shoulder angles count.
    """
    size, lower, upper = problem.size, problem.lower, problem.upper
    target, pose = work.target, work.new
    side, first = (-1.0, 4) if limb else (1.0, 1)
    x, y = target[3 * limb], target[3 * limb + 1]
    along = side * (x * sine - y * cosine) - size.L12
    ahead = x * cosine + y * sine
    above = target[3 * limb + 2] - size.L01
    if side > 0.0:
        arm = Planar(size.L23, size.L34, lower[2], upper[2], lower[3], upper[3])
    else:
        arm = Planar(size.L23, size.L34, -upper[5], -lower[5], -upper[6], -lower[6])
    away = sqrt(along * along + ahead * ahead + above * above)
    gap = max(away - arm.upper - arm.fore, abs(arm.upper - arm.fore) - away, 0.0)
    least = gap * gap * (1.0 + 1e-12) + 1e-26  # no pose does better
    towards = atan2(ahead, -above)
    error = np.inf
    slope = 0.0
    for turn in (0.0, pi):
        shoulder = nearest_angle(towards + turn, lower[first], upper[first])
        ss, cs = sine_and_cosine(shoulder)
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
            slope = (
                2.0
                * side
                * (
                    (size.L12 + tip_along) * (tip_out * ss - ahead)
                    - tip_out * ss * (tip_along - along)
                )
            )
            if error <= least:
                break
    return error, slope


@compiled
def _place_planar(
    arm: Planar, x: float, y: float, least: float
) -> tuple[float, float, float, float, float]:
    """Return elbow, fingertip, tip x, tip y and the least squared distance of the tip from (x, y).

    At the best pose the fingertip is at a limit, or bent as far as the distance asks, inwards or
    outwards; or else the elbow is at a limit. Each gives the other joint. Ends early at ``least``.
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
            sf, cf = sine_and_cosine(f)
            e = nearest_angle(bearing - atan2(b * sf, a + b * cf), arm.e_low, arm.e_high)
            se, ce = sine_and_cosine(e)
        else:
            e = arm.e_low if k == 4 else arm.e_high
            se, ce = sine_and_cosine(e)
            f = nearest_angle(atan2(y - a * se, x - a * ce) - e, arm.f_low, arm.f_high)
            sf, cf = sine_and_cosine(f)
        tip_x = a * ce + b * (ce * cf - se * sf)
        tip_y = a * se + b * (se * cf + ce * sf)
        missed = (tip_x - x) ** 2 + (tip_y - y) ** 2
        if missed < best[4]:
            best = (e, f, tip_x, tip_y, missed)
            if missed <= least:
                break
    return best


class Waist(NamedTuple):
    """An angle of the waist, and the best pose with it."""

    angle: float  # rad
    value: float  # Eq. 13
    slope: float  # its derivative by the angle


class Waists(NamedTuple):
    """Angles of the waist, from limit to limit: a cell lies between two neighbours."""

    angles: Array  # rad
    values: Array  # Eq. 13 of the best pose with this waist; infinity where it is not known
    slopes: Array  # its derivative by the waist
    fastest: float  # m/rad, no residual changes faster with the waist


@compiled
def search_waist(problem: Problem, work: Work) -> None:
    """Find the best pose of all.

    Of a target in reach the head alone gives the waist. Otherwise the range of the waist is cut
    into cells, and those into halves, down to ``_CELL``, except where a cell cannot reach down to
    the best value known. Then each of the finest cells is searched in which there is a valley: one
    into which it goes down from its lower end.
    """
    low, high = problem.lower[0], problem.upper[0]
    bearing = atan2(work.target[7], work.target[6])
    for turn in (0.0, pi):
        _visit(problem, work, nearest_angle(bearing + turn, low, high))
        if work.value <= problem.enough:
            return
    count = _HALVES * (int((high - low) / (_CELL * _HALVES)) + 1) + 1
    waists = Waists(
        np.linspace(low, high, count),
        np.full(count, np.inf),
        np.empty(count),
        _fastest(problem, work),
    )
    for k in range(0, count, _HALVES):
        _note(waists, k, _visit(problem, work, waists.angles[k]))
    width = _HALVES
    while width > 1:
        half = width // 2
        for k in range(half, count, width):
            if _promises(waists, k - half, k + half, work):
                _note(waists, k, _visit(problem, work, waists.angles[k]))
        width = half
    for k in range(count - 1):
        if _promises(waists, k, k + 1, work) and _falls_inwards(waists, k):
            _search_cell(problem, work, _known(waists, k), _known(waists, k + 1))


@compiled
def _visit(problem: Problem, work: Work, angle: float) -> Waist:
    """Call :func:`place_body`, count it, and keep the pose if it is the best so far."""
    value, slope = place_body(problem, work, angle)
    work.evaluations += 1
    better(work, work.new, value)
    return Waist(angle, value, slope)


@compiled
def _note(waists: Waists, cell: int, waist: Waist) -> None:
    waists.values[cell], waists.slopes[cell] = waist.value, waist.slope


@compiled
def _known(waists: Waists, cell: int) -> Waist:
    return Waist(waists.angles[cell], waists.values[cell], waists.slopes[cell])


@compiled
def _fastest(problem: Problem, work: Work) -> float:
    """Return how fast the residual can change with the waist, in m/rad.

    An extremity moves by its distance from the waist's axis, and seen from the body so does a
    target: whichever is less.
    """
    size, target = problem.size, work.target
    total = 0.0
    for limb in range(3):
        circle = size.LH2 if limb == 2 else size.L12 + size.L23 + size.L34
        total += min(circle**2, target[3 * limb] ** 2 + target[3 * limb + 1] ** 2)
    fastest: float = sqrt(total)
    return fastest


@compiled
def _promises(waists: Waists, left: int, right: int, work: Work) -> bool:
    """Whether both ends of a cell are known, and something better may lie between them."""
    if waists.values[left] == np.inf or waists.values[right] == np.inf:
        return False
    fall = waists.fastest * (waists.angles[right] - waists.angles[left])
    least = 0.5 * (sqrt(waists.values[left]) + sqrt(waists.values[right]) - fall)
    promises: bool = least < sqrt(work.value)
    return promises


@compiled
def _falls_inwards(waists: Waists, cell: int) -> bool:
    """Whether it goes down from the lower end of a cell into it, so that there is a valley."""
    if waists.values[cell] < waists.values[cell + 1]:
        return bool(waists.slopes[cell] < 0.0)
    return bool(waists.slopes[cell + 1] > 0.0)


@compiled
def _search_cell(problem: Problem, work: Work, left: Waist, right: Waist) -> None:
    """Find the floor of the valley in a cell, and that of a second one.

    Halfway from the floor to an end of the cell it goes up towards the end, unless another valley
    lies there.
    """
    floor = _descend(problem, work, left, right)
    halfway = _visit(problem, work, 0.5 * (left.angle + floor))
    if halfway.slope > 0.0:
        _descend(problem, work, left, halfway)
    halfway = _visit(problem, work, 0.5 * (floor + right.angle))
    if halfway.slope < 0.0:
        _descend(problem, work, halfway, right)


@compiled
def _descend(problem: Problem, work: Work, left: Waist, right: Waist) -> float:
    """Find the floor of a valley, where the slope is 0; return the waist's angle there.

    Regula falsi (Illinois) while the slope falls on the left and rises on the right; otherwise, and
    every third time, the middle. Where a cell holds two valleys, the side with the lower end is
    kept. Ends where what is left to gain, at most slope times width, is a hundredth of what counts.
    """
    falls, rises = left.slope, right.slope
    turn, gain = 0, np.inf
    angle = 0.5 * (left.angle + right.angle)
    while right.angle - left.angle > _FINE and gain > 0.01 * sqrt(problem.enough * work.value):
        turn += 1
        angle = 0.5 * (left.angle + right.angle)
        if falls < 0.0 < rises and turn % 3 > 0:
            angle = (left.angle * rises - right.angle * falls) / (rises - falls)
        new = _visit(problem, work, angle)
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


@compiled
def choose_nearest(problem: Problem, work: Work, start: Array, pose: Array) -> None:
    """Of the poses that put hands and head on the same points, take the one nearest to ``start``.

    While the waist stays, those are four for each arm. With the waist turned by π the head can be
    nodded over to the same point; that counts where it brings Eq. 13 down to what is enough.
    """
    lower, upper, present, other = problem.lower, problem.upper, np.empty(8), np.empty(8)
    for j in range(8):
        present[j] = min(max(start[j], lower[j]), upper[j])
    if _is_nearest(present, pose):
        return
    distance = _choose_arms(problem, present, pose)
    waist = nearest_angle(pose[0] + pi, lower[0], upper[0])
    nod = nearest_angle(pi - pose[7], lower[7], upper[7])
    if abs(wrapped(waist - pose[0] - pi)) > _SLIGHT or abs(wrapped(nod + pose[7] - pi)) > _SLIGHT:
        return
    value, _ = place_body(problem, work, waist)
    other[:] = work.new
    if value <= problem.enough and _choose_arms(problem, present, other) < distance:
        pose[:] = other


@compiled
def _is_nearest(start: Array, pose: Array) -> bool:
    """Whether a pose is so near to ``start`` that no other with the same points can be nearer.

    The others turn the waist or a shoulder by π, or bend a fingertip as far to the other side.
    """
    total = 0.0
    for j in range(8):
        total += (pose[j] - start[j]) ** 2
    near: bool = total <= min(pose[3] ** 2, pose[6] ** 2, 0.25 * pi * pi)
    return near


@compiled
def _choose_arms(problem: Problem, start: Array, pose: Array) -> float:
    """Let each arm take its pose nearest to ``start``; return the squared distance of the whole."""
    distance: float = (pose[0] - start[0]) ** 2 + (pose[7] - start[7]) ** 2
    for first in (1, 4):
        distance += _choose_arm(problem, start, pose, first)
    return distance


@compiled
def _choose_arm(problem: Problem, start: Array, q: Array, first: int) -> float:
    """Of the arm's poses with this hand position, take the one nearest to ``start``.

    While the waist stays, only four poses put the hand on the same point: this one, the elbow
    mirrored about the line from shoulder to hand, the shoulder turned by π, and both together.
    With the hand on the shoulder axis any shoulder angle will do. Returns the squared distance.
    """
    size, lower, upper = problem.size, problem.lower, problem.upper
    s, e, f = q[first], q[first + 1], q[first + 2]
    se, ce = sine_and_cosine(e)
    sef, cef = sine_and_cosine(e + f)
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
                outside = max(outside, abs(wrapped(allowed - angle)))
                distance += (allowed - start[j]) ** 2
            if distance < shortest and (outside <= _SLIGHT or (side > 0.0 and mirror > 0.0)):
                shortest = distance
                for j, angle in enumerate((shoulder, elbow, side * mirror * f), first):
                    q[j] = nearest_angle(angle, lower[j], upper[j])
    return shortest
