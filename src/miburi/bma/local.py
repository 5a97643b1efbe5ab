"""The local searches: each moves a bacterium downhill, by Eq. 12 or by damped Newton steps.

Each local search is a generator, which yields points, (k, n), and is sent the function's results at
these points: residuals, (k, m), or values, (k, 1). The search changes its bacterium in place.
"""

from collections.abc import Callable, Generator
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from miburi.bma import operators as op
from miburi.bma.settings import Array, Settings
from miburi.errors import InputError
from miburi.ground.arguments import real_numbers

#: Maps a point, (n,), to the derivatives of the function's residuals, (m, n), or value, (n,).
Jacobian = Callable[[Array], ArrayLike]
#: Yields points, and is sent the function's results at these points. At the end it returns the
#: value that was reached, and whether the residuals proved to be linear.
LocalSearch = Generator[Array, Array, tuple[float, bool]]

_ROUNDING = 1e-16  # a relative gain smaller than this does not count
_FIRST = 0.05  # the first step of a gradient search, as a share of each variable's range
_WIDE = 0.01  # a step this long, in ranges, tells a linear function from a curved one
_SWEEPS = 3  # how often, at most, a search restarts from clones with a variable at a bound


class Problem(NamedTuple):
    """The box, the settings, and the derivatives if they are known."""

    lower: Array
    upper: Array
    settings: Settings
    jacobian: Jacobian | None

    @property
    def by_residual(self) -> bool:
        """Whether the searches see residuals, or only the value."""
        return self.settings.local_search == "residual"


def search_locally(
    problem: Problem, x: Array, told: Array | None, best: float, iterations: int
) -> LocalSearch:
    """Improve a bacterium in place; ``best`` is the best value known.

    ``told`` is the function's result at ``x``: a value, (1,), or residuals, (m,); None if unknown.
    """
    if told is None:
        told = (yield x[None])[0].copy()
    if problem.by_residual:
        return (yield from _search_from_ends(problem, x, told, best, iterations))
    if told[0] == np.inf:
        return np.inf, False  # a point that is not allowed has no slope
    if problem.settings.local_search == "printed":
        return (yield from _search_as_printed(problem, x, told, iterations))
    return (yield from _descend(problem, x, told, best, iterations))


def _search_as_printed(problem: Problem, x: Array, told: Array, iterations: int) -> LocalSearch:
    """Search as the paper's Eq. 12 does, without scaling its damping γ and tolerance τ."""
    damping, gradient = problem.settings.damping, np.empty(0)
    for _ in range(iterations):
        if not gradient.size:
            gradient = (yield from _slopes(problem, x, told))[0]
        if np.sqrt(gradient @ gradient) <= problem.settings.gradient_tolerance:
            break
        step, predicted = op.printed_step(gradient, damping)
        new = inside(problem, x, step)
        found = (yield new[None])[0]
        damping = op.damped(damping, float(found[0] - told[0]), predicted)
        if found[0] < told[0]:
            told, x[:], gradient = found, new, np.empty(0)
    return float(told[0]), False


def _search_from_ends(
    problem: Problem, x: Array, told: Array, best: float, iterations: int
) -> LocalSearch:
    """Search by least squares; then, while it helps, try clones with one variable at a bound."""
    ends = problem.settings.ends
    value, linear = yield from _descend(problem, x, told, best, iterations)
    for _ in range(_SWEEPS if ends else 0):
        clones = op.ends(x, problem.lower, problem.upper)
        rows = yield clones
        order = op.promising(x, problem.lower, problem.upper, np.einsum("ij,ij->i", rows, rows))
        for new in clones[order[:ends]]:
            told, best = (yield new[None])[0].copy(), min(best, value)
            new_value, _ = yield from _descend(problem, new, told, best, iterations)
            if new_value < value * (1.0 - op.SLIGHT):
                value, x[:] = new_value, new
                break
        else:
            break
    return value, linear


def _descend(problem: Problem, x: Array, told: Array, best: float, iterations: int) -> LocalSearch:
    """Take damped Newton steps from ``x``, where the function returned ``told``, (m,) or (1,).

    Half the Hessian is JᵀJ for residuals; for other functions, BFGS estimates it from the gradients
    along the way. Steps and derivatives measure each variable in units of ``scale``.
    """
    settings, by_residual = problem.settings, problem.by_residual
    width = problem.upper - problem.lower
    scale = np.where(settings.relative & (width > 0.0), width, 1.0)
    value = float(told @ told if by_residual else told[0])
    gradient, normal, step = np.zeros(x.size), np.empty((0, 0)), np.zeros(x.size)
    damping, unit, known, far, linear = 0.0, 1.0, 0, 0.0, by_residual
    accepted = bool(np.isfinite(value))
    for _ in range(iterations if accepted else 0):
        if accepted:
            old, slopes = gradient, (yield from _slopes(problem, x, told)) * scale
            if by_residual:
                gradient, normal = 2.0 * told @ slopes, slopes.T @ slopes
            else:
                gradient = slopes[0]
                normal = _learn(known, normal, step, gradient, old)
            if known < (1 if by_residual else 2):
                greatest = float(normal.diagonal().max()) if settings.relative else 1.0
                damping, unit = settings.damping, greatest or 1.0
            known += 1
        moves = op.free(x, gradient, problem.lower, problem.upper)
        if np.sqrt(gradient[moves] @ gradient[moves]) <= settings.gradient_tolerance:
            break
        new = inside(problem, x, op.newton_step(normal, gradient, moves, damping * unit) * scale)
        step = (new - x) / scale
        predicted = float(gradient @ step + step @ normal @ step)
        if settings.relative and -predicted <= _ROUNDING * abs(value):
            break
        found = (yield new[None])[0].copy()
        gain = value - float(found @ found if by_residual else found[0])
        damping = op.damped(damping, -gain, predicted)
        linear &= abs(gain + predicted) <= op.SLIGHT * -predicted + 1e-14 * abs(value)
        accepted = gain > 0.0
        if accepted:
            told, value, x[:] = found, value - gain, new
            best, far = min(best, value), max(far, float(np.abs(step).max()))
            # Our rule, not the paper's: give up if even a thousand gains like the last would not
            # reach ``best``, the best value known.
            slight = (1e-8 if by_residual else _ROUNDING) * abs(value)
            if value - 1e3 * gain > best or gain <= slight:
                break
    # The linear model predicted every step, and one of them was wide: the residuals are linear.
    return value, bool(linear and settings.relative and far >= _WIDE)


def _learn(known: int, normal: Array, step: Array, gradient: Array, old: Array) -> Array:
    """Return half the Hessian after a new ``gradient``; ``known`` counts the earlier gradients."""
    if known == 0:  # scaled so that the first step is about _FIRST long
        return np.eye(gradient.size) * float(np.linalg.norm(gradient)) / (2.0 * _FIRST)
    change = gradient - old
    along = float(step @ change)
    if known == 1 and along > 0.0:
        normal = np.eye(gradient.size) * float(change @ change) / (2.0 * along)
    return op.curve(normal, step, change)


def _slopes(problem: Problem, x: Array, told: Array) -> Generator[Array, Array, Array]:
    """Return the derivatives, (m, n), at ``x``, where the function's value is ``told``."""
    if problem.jacobian is not None:
        wanted = f"finite derivatives of the shape {(told.size, x.size)}"
        given = np.atleast_2d(real_numbers(problem.jacobian(x), "jacobian(x)", wanted))
        if given.shape != (told.size, x.size) or not np.isfinite(given).all():
            raise InputError(f"jacobian(x) must be {wanted}, got {given.tolist()}.")
        return given
    points = op.stencil(x, problem.lower, problem.upper)
    values = yield points
    return op.differences(x, told, points, values)


def inside(problem: Problem, x: Array, step: Array) -> Array:
    """Return x + s clipped to the box (the clipping is ours), or ``x`` where x + s is NaN."""
    new = x + step
    new[np.isnan(new)] = x[np.isnan(new)]
    return np.minimum(np.maximum(new, problem.lower), problem.upper)
