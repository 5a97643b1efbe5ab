"""The exact constrained optimum of Eq. 13, by this body's structure: the truth to compare with.

With the waist fixed, each arm and the head stand alone, and each has its optimum in closed form:
a stationary point lies inside the limits (hand on its target, or arm stretched towards it) or on
some of them, and for each combination of limits it is known. What is left is a search over one
angle: a grid, then its best cells ever finer. No code is shared with the solver.
"""

import numpy as np

GRID = 721  # waist angles; 0.28 degrees apart
CELLS = 6  # of them are refined
ZOOMS = 7  # times, 8 times finer each


def optimum(robot, target):
    """The least residual, in m, that any pose inside the limits has for a target, (9,) m."""
    target = np.asarray(target, dtype=float)
    low, high = robot.lower[0], robot.upper[0]
    waists = np.linspace(low, high, GRID)
    costs = _cost(robot, target, waists)
    step = waists[1] - waists[0]
    inner = np.r_[True, costs[1:] <= costs[:-1]] & np.r_[costs[:-1] <= costs[1:], True]
    valleys = np.flatnonzero(inner)
    valleys = valleys[np.argsort(costs[valleys])][:CELLS]
    centres, best = waists[valleys], costs[valleys].min()
    for _ in range(ZOOMS):
        fine = np.clip(centres[:, None] + np.linspace(-step, step, 17), low, high)
        values = _cost(robot, target, fine.ravel()).reshape(fine.shape)
        centres = fine[np.arange(len(fine)), values.argmin(axis=1)]
        best = min(best, values.min())
        step /= 8
    return float(np.sqrt(best))


def _cost(robot, target, waist):
    size, (lower, upper) = robot.lengths, (robot.lower, robot.upper)
    left = np.stack([-np.sin(waist), np.cos(waist)], axis=-1)
    fwd = np.stack([np.cos(waist), np.sin(waist)], axis=-1)
    right = _arm(
        size, -left @ target[0:2] - size.L12, fwd @ target[0:2], target[2] - size.L01,
        lower[1:4], upper[1:4],
    )  # fmt: skip
    mirrored = (
        np.array([lower[4], -upper[5], -upper[6]]),
        np.array([upper[4], -lower[5], -lower[6]]),
    )
    other = _arm(
        size, left @ target[3:5] - size.L12, fwd @ target[3:5], target[5] - size.L01, *mirrored
    )
    ahead, rise = fwd @ target[6:8], np.full(waist.shape, target[8] - size.L01 - size.LH1)
    nod = np.stack([np.arctan2(rise, ahead), *np.broadcast_arrays(lower[7], upper[7], waist)[:2]])
    nod = np.clip(nod, lower[7], upper[7])
    head = (size.LH2 * np.cos(nod) - ahead) ** 2 + (size.LH2 * np.sin(nod) - rise) ** 2
    return right + other + head.min(axis=0) + (left @ target[6:8]) ** 2


def _arm(size, along, ahead, height, lower, upper):
    """Least squared distance of a hand from points, (k,), given from the shoulder."""
    height = np.full(along.shape, height)
    towards = np.arctan2(ahead, -height)
    best = np.full(along.shape, np.inf)
    for shoulder in (towards, towards + np.pi, towards - np.pi, lower[0], upper[0]):
        s = np.clip(np.broadcast_to(shoulder, along.shape), lower[0], upper[0])
        out = np.sin(s) * ahead - np.cos(s) * height
        across = (np.cos(s) * ahead + np.sin(s) * height) ** 2
        best = np.minimum(best, across + _two_links(size, along, out, lower[1:], upper[1:]))
    return best


def _two_links(size, x, y, lower, upper):
    """Least squared distance of a planar two-link arm's tip from points (x, y)."""
    a, b = size.L23, size.L34
    bearing = np.arctan2(y, x)
    candidates = []
    bend = np.arccos(np.clip((x**2 + y**2 - a**2 - b**2) / (2 * a * b), -1, 1))
    for free in (bend, -bend, 0 * bend, lower[1] + 0 * bend, upper[1] + 0 * bend):
        f = np.clip(free, lower[1], upper[1])
        offset = np.arctan2(b * np.sin(f), a + b * np.cos(f))
        candidates += [(_wrapped(bearing - offset + turn), f) for turn in (0, np.pi)]
        candidates += [(lower[0] + 0 * f, f), (upper[0] + 0 * f, f)]
    for e in (lower[0], upper[0]):
        direct = np.arctan2(y - a * np.sin(e), x - a * np.cos(e)) - e
        candidates += [(e + 0 * x, _wrapped(direct + turn)) for turn in (0, np.pi)]
    best = np.full(x.shape, np.inf)
    for bent in candidates:
        e, f = (np.clip(bent[i], lower[i], upper[i]) for i in (0, 1))
        tip_x, tip_y = a * np.cos(e) + b * np.cos(e + f), a * np.sin(e) + b * np.sin(e + f)
        best = np.minimum(best, (tip_x - x) ** 2 + (tip_y - y) ** 2)
    return best


def _wrapped(angle):
    return (angle + np.pi) % (2 * np.pi) - np.pi
