"""The limits of speed: this body's closed form and its waist search, both compiled.

Neither shares code with the solver. They are called from Python as the solver is, one target a
call, with its checks of shape and size; what they give back is the pose.
"""

from math import acos, atan2, cos, hypot, pi, sin, sqrt

import numba
import numpy as np
from peers import ROBOT

SIZE = tuple(vars(ROBOT.lengths).values())
LOWER, UPPER = ROBOT.lower.copy(), ROBOT.upper.copy()


@numba.njit(cache=True, error_model="numpy")
def _arm(along, ahead, above, low, high, fore, side, pose, first):
    """Write the first of the four poses that is inside the limits; say whether there is one."""
    a, b = fore
    swing = hypot(ahead, above)
    cos_f = (along * along + swing * swing - a * a - b * b) / (2.0 * a * b)
    if abs(cos_f) > 1.0 + 1e-9:
        return False
    bend = acos(min(max(cos_f, -1.0), 1.0))
    towards = atan2(ahead, -above)
    offset = atan2(b * sin(bend), a + b * cos(bend))
    for turn in (0.0, pi, -pi):
        shoulder = towards + turn
        bearing = atan2(swing if turn == 0.0 else -swing, along)
        for mirror in (1.0, -1.0):
            pose[first] = shoulder
            pose[first + 1] = side * (bearing - mirror * offset)
            pose[first + 2] = side * mirror * bend
            inside = True
            for j in range(first, first + 3):
                inside &= low[j] - 1e-7 <= pose[j] <= high[j] + 1e-7
                pose[j] = min(max(pose[j], low[j]), high[j])
            if inside:
                return True
    return False


@numba.njit(cache=True, error_model="numpy")
def _closed_form(target, low, high, size, pose):
    l01, l12, l23, l34, lh1, _ = size
    pose[0] = atan2(target[7], target[6])
    s, c = sin(pose[0]), cos(pose[0])
    pose[7] = atan2(target[8] - l01 - lh1, hypot(target[6], target[7]))
    found = True
    for first, side in ((1, 1.0), (4, -1.0)):
        x, y, z = target[first - 1], target[first], target[first + 1]
        along = side * (x * s - y * c) - l12
        found &= _arm(along, x * c + y * s, z - l01, low, high, (l23, l34), side, pose, first)
    return found


def closed_form(target, _):
    """Solve for a target in reach."""
    if target.shape != (9,) or not np.isfinite(target.dot(target)):
        raise ValueError(target)
    pose = np.empty(8)
    _closed_form(target, LOWER, UPPER, SIZE, pose)
    return pose


@numba.njit(cache=True, error_model="numpy")
def _within(angle, low, high):
    middle = 0.5 * (low + high)
    angle -= 2.0 * pi * round((angle - middle) / (2.0 * pi))
    return min(max(angle, low), high)


@numba.njit(cache=True, error_model="numpy")
def _best_arm(along, ahead, above, low, high, fore, side, pose, first):
    """The best pose of an arm, over all combinations of limits; return the squared error."""
    a, b = fore
    e_low, e_high = (
        (low[first + 1], high[first + 1]) if side > 0 else (-high[first + 1], -low[first + 1])
    )
    f_low, f_high = (
        (low[first + 2], high[first + 2]) if side > 0 else (-high[first + 2], -low[first + 2])
    )
    best = np.inf
    towards = atan2(ahead, -above)
    for turn in (0.0, pi):
        s = _within(towards + turn, low[first], high[first])
        out, across = sin(s) * ahead - cos(s) * above, cos(s) * ahead + sin(s) * above
        if across * across >= best:
            continue
        bearing, far = atan2(out, along), hypot(out, along)
        bend = acos(min(max((far * far - a * a - b * b) / (2.0 * a * b), -1.0), 1.0))
        for k in range(6):
            if k < 4:
                f = (bend, -bend, f_low, f_high)[k]
                if f < f_low or f > f_high:
                    continue
                e = _within(bearing - atan2(b * sin(f), a + b * cos(f)), e_low, e_high)
            else:
                e = e_low if k == 4 else e_high
                f = _within(atan2(out - a * sin(e), along - a * cos(e)) - e, f_low, f_high)
            tip, rise = a * cos(e) + b * cos(e + f) - along, a * sin(e) + b * sin(e + f) - out
            error = across * across + tip * tip + rise * rise
            if error < best:
                best = error
                pose[first], pose[first + 1], pose[first + 2] = s, side * e, side * f
    return best


@numba.njit(cache=True, error_model="numpy")
def _body(target, waist, low, high, size, pose):
    l01, l12, l23, l34, lh1, lh2 = size
    s, c = sin(waist), cos(waist)
    pose[0] = waist
    ahead, aside = target[6] * c + target[7] * s, target[6] * s - target[7] * c
    rise = target[8] - l01 - lh1
    pose[7] = _within(atan2(rise, ahead), low[7], high[7])
    total = (lh2 * cos(pose[7]) - ahead) ** 2 + (lh2 * sin(pose[7]) - rise) ** 2 + aside**2
    for first, side in ((1, 1.0), (4, -1.0)):
        x, y, z = target[first - 1], target[first], target[first + 1]
        along = side * (x * s - y * c) - l12
        total += _best_arm(along, x * c + y * s, z - l01, low, high, (l23, l34), side, pose, first)
    return total


@numba.njit(cache=True, error_model="numpy")
def _waist_search(target, low, high, size, grid, pose):
    """A grid over the waist; then a golden section in each valley."""
    new, values = np.empty(8), np.empty(grid)
    step = (high[0] - low[0]) / (grid - 1)
    best = np.inf
    for k in range(grid):
        values[k] = _body(target, low[0] + k * step, low, high, size, new)
        if values[k] < best:
            best = values[k]
            pose[:] = new
    golden = 0.5 * (sqrt(5.0) - 1.0)
    for k in range(grid):
        before, after = values[max(k - 1, 0)], values[min(k + 1, grid - 1)]
        if values[k] > before or values[k] > after:
            continue
        left, right = low[0] + max(k - 1, 0) * step, low[0] + min(k + 1, grid - 1) * step
        p, q = right - golden * (right - left), left + golden * (right - left)
        at_p, at_q = _body(target, p, low, high, size, new), _body(target, q, low, high, size, new)
        while right - left > 1e-7:
            if at_p < at_q:
                right, q, at_q = q, p, at_p
                p = right - golden * (right - left)
                at_p = _body(target, p, low, high, size, new)
            else:
                left, p, at_p = p, q, at_q
                q = left + golden * (right - left)
                at_q = _body(target, q, low, high, size, new)
        value = _body(target, 0.5 * (left + right), low, high, size, new)
        if value < best:
            best = value
            pose[:] = new
    return best


#: Angles of the waist: 0.06 rad apart, so that nothing is missed by a valley between two of them.
GRID = 61


def waist_search(target, _):
    """Find the best pose for any target."""
    if target.shape != (9,) or not np.isfinite(target.dot(target)):
        raise ValueError(target)
    pose = np.empty(8)
    _waist_search(target, LOWER, UPPER, SIZE, GRID, pose)
    return pose
