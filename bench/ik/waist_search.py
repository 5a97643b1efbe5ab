"""The exact constrained optimum of Eq. 13, by this body's structure: the truth to compare with.

With the waist fixed, each arm and the head stand alone, and each has its optimum in closed form:
a stationary point lies inside the limits (hand on its target, or arm stretched towards it) or on
some of them, and for each combination of limits it is known. What is left is a search over one
angle: a grid, then its best cells ever finer. No code is shared with the solver.
"""

from math import acos, atan2, cos, pi, sin, sqrt

import numba
import numpy as np

GRID = 721  # waist angles; 0.28 degrees apart
CELLS = 6  # of them are refined
ZOOMS = 7  # times, 8 times finer each

_compiled = numba.njit(cache=True, error_model="numpy", nogil=True)


def optimum(robot, target):
    """The least residual, in m, that any pose inside the limits has for a target, (9,) m."""
    size = tuple(robot.lengths.model_dump().values())
    return _optimum(size, robot.lower, robot.upper, np.array(target, dtype=float))


@_compiled
def _optimum(size, lower, upper, target):
    waists = np.linspace(lower[0], upper[0], GRID)
    costs = np.array([_cost(size, lower, upper, target, waist) for waist in waists])
    step = waists[1] - waists[0]
    inner = np.ones(GRID, np.bool_)
    inner[1:] &= costs[1:] <= costs[:-1]
    inner[:-1] &= costs[:-1] <= costs[1:]
    valleys = np.flatnonzero(inner)
    valleys = valleys[np.argsort(costs[valleys])][:CELLS]
    best = costs[valleys].min()
    for valley in waists[valleys]:
        centre, half = valley, step
        for _ in range(ZOOMS):
            fine = np.minimum(np.maximum(centre + np.linspace(-half, half, 17), lower[0]), upper[0])
            values = np.array([_cost(size, lower, upper, target, waist) for waist in fine])
            centre = fine[values.argmin()]
            best = min(best, values.min())
            half /= 8
    return sqrt(best)


@_compiled
def _cost(size, lower, upper, target, waist):
    """The least of Eq. 13 with this waist."""
    l01, l12, l23, l34, lh1, lh2 = size
    s, c = sin(waist), cos(waist)
    total = (target[6] * s - target[7] * c) ** 2
    ahead, rise = target[6] * c + target[7] * s, target[8] - l01 - lh1
    head = np.inf
    for nod in (atan2(rise, ahead), lower[7], upper[7]):
        n = _clipped(nod, lower[7], upper[7])
        head = min(head, (lh2 * cos(n) - ahead) ** 2 + (lh2 * sin(n) - rise) ** 2)
    total += head
    for first, side in ((1, 1.0), (4, -1.0)):
        x, y, height = target[first - 1], target[first], target[first + 1] - l01
        along, ahead = side * (x * s - y * c) - l12, x * c + y * s
        shoulder = lower[first], upper[first]
        low, high = lower[first + 1 : first + 3], upper[first + 1 : first + 3]
        if side < 0.0:
            low, high = -high, -low
        total += _arm((l23, l34), along, ahead, height, shoulder, low, high)
    return total


@_compiled
def _arm(links, along, ahead, height, shoulder, lower, upper):
    """Least squared distance of a hand from a point that is given from the shoulder."""
    towards = atan2(ahead, -height)
    best = np.inf
    for candidate in (towards, towards + pi, towards - pi, shoulder[0], shoulder[1]):
        s = _clipped(candidate, shoulder[0], shoulder[1])
        out = sin(s) * ahead - cos(s) * height
        across = (cos(s) * ahead + sin(s) * height) ** 2
        if across < best:
            best = min(best, across + _two_links(links, along, out, lower, upper))
    return best


@_compiled
def _two_links(links, x, y, lower, upper):
    """Least squared distance of a planar two-link arm's tip from (x, y)."""
    a, b = links
    bearing = atan2(y, x)
    bend = acos(_clipped((x**2 + y**2 - a**2 - b**2) / (2 * a * b), -1.0, 1.0))
    best = np.inf
    for free in (bend, -bend, 0.0, lower[1], upper[1]):
        f = _clipped(free, lower[1], upper[1])
        direct = bearing - atan2(b * sin(f), a + b * cos(f))
        for e in (_wrapped(direct), _wrapped(direct + pi), lower[0], upper[0]):
            best = min(best, _missed(links, x, y, _clipped(e, lower[0], upper[0]), f))
    for e in (lower[0], upper[0]):
        direct = atan2(y - a * sin(e), x - a * cos(e)) - e
        for f in (_wrapped(direct), _wrapped(direct + pi)):
            best = min(best, _missed(links, x, y, e, _clipped(f, lower[1], upper[1])))
    return best


@_compiled
def _missed(links, x, y, e, f):
    """Squared distance of the tip from (x, y), with elbow and fingertip at these angles."""
    a, b = links
    return (a * cos(e) + b * cos(e + f) - x) ** 2 + (a * sin(e) + b * sin(e + f) - y) ** 2


@_compiled
def _clipped(value, low, high):
    return min(max(value, low), high)


@_compiled
def _wrapped(angle):
    return (angle + pi) % (2 * pi) - pi
