"""The operators of the Bacterial Memetic Algorithm (Section 3).

They take bacteria, random numbers and values computed elsewhere, and give new points. None of them
evaluates anything; :mod:`miburi.bma.search` calls them in order.
"""

import numpy as np
from numpy.typing import NDArray

from miburi.bma.settings import Array

Ints = NDArray[np.int64]

#: A relative gain smaller than this does not count.
SLIGHT = 1e-6

_STENCIL = 1e-6  # half width of a central difference, as a share of a variable's range
_FINEST = 1e-14  # but at least this share of the variable, so that the points differ
_SMALLEST_DAMPING, _LARGEST_DAMPING = 1e-15, 1e15
# SplitMix64 (Steele, Lea and Flood 2014)
_STEP, _MIX, _MIX_AGAIN = np.array(
    [0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB], dtype=np.uint64
)


def draw(state: NDArray[np.uint64], count: int) -> Array:
    """Return ``count`` random numbers from [0, 1), and advance ``state`` (1,) past them."""
    z = state + np.arange(1, count + 1, dtype=np.uint64) * _STEP
    state[:] = z[-1:]
    z = (z ^ (z >> 30)) * _MIX
    z = (z ^ (z >> 27)) * _MIX_AGAIN
    z ^= z >> 31
    numbers: Array = (z >> 11) * 2.0**-53
    return numbers


def shuffle(genes: list[int], shares: Array) -> None:
    """Shuffle the indices of n variables in place, with n - 1 random numbers (Fisher, Yates)."""
    for i, u in zip(range(len(genes) - 1, 0, -1), shares.tolist(), strict=True):
        j = int(u * (i + 1))
        genes[i], genes[j] = genes[j], genes[i]


def mutants(population: Array, segments: Ints, values: Array) -> Array:
    """Bacterial mutation: return the changed copies of each bacterium, (bacteria, copies, n).

    ``segments``, (bacteria, k), names the variables that change; ``values``, (bacteria, copies,
    k), are their new values.
    """
    bacteria, copies, _ = values.shape
    clones = np.repeat(population[:, None], copies, axis=1)
    which = np.arange(bacteria)[:, None, None], np.arange(copies)[:, None], segments[:, None]
    clones[which] = values
    return clones


def rank(population: Array, costs: Array) -> None:
    """Sort the bacteria, best first; bacteria of equal cost keep their order."""
    order = np.argsort(costs, kind="stable")
    population[:], costs[:] = population[order], costs[order]


def transfer(population: Array, genes: list[int], shares: Array) -> int:
    """Gene transfer within a ranked population; return the index of the changed bacterium.

    The first two random ``shares`` choose the giver from the better half and the taker from the
    worse half; each further share chooses a gene.
    """
    individuals, half = len(population), len(population) // 2
    one, other, *picks = shares.tolist()
    giver, taker = int(one * half), half + int(other * (individuals - half))
    for k, u in enumerate(picks):
        pick = k + int(u * (len(genes) - k))
        genes[k], genes[pick] = genes[pick], genes[k]
        population[taker, genes[k]] = population[giver, genes[k]]
    return taker


def stencil(x: Array, lower: Array, upper: Array) -> Array:
    """Return the two neighbours of ``x`` along each variable, (2n, n), never outside the box."""
    half = np.maximum(_STENCIL * (upper - lower), _FINEST * np.abs(x))
    points, j = np.repeat(x[None], 2 * x.size, axis=0), np.arange(x.size)
    points[2 * j, j] = np.minimum(x + half, upper)
    points[2 * j + 1, j] = np.maximum(x - half, lower)
    return points


def differences(x: Array, centre: Array, points: Array, values: Array) -> Array:
    """Second-order central differences (Section 3) of the (2n, m) values at a :func:`stencil`.

    If a neighbour would lie outside the box or has an infinite value, the difference is one-sided
    and uses ``centre``, (m,), the values at ``x``. The result is (m, n).
    """
    above, below = np.diagonal(points[::2]), np.diagonal(points[1::2])
    high, low = values[::2].T, values[1::2].T
    width = above - below
    if not np.isfinite(values).all():
        high_known, low_known = np.isfinite(high), np.isfinite(low)
        centres = np.broadcast_to(centre[:, None], high.shape)
        width = np.where(high_known, np.where(low_known, width, above - x), x - below)
        low = np.where(low_known | ~high_known, low, centres)
        high = np.where(high_known, high, centres)
    slopes: Array = (high - low) / width
    known = np.isfinite(slopes)
    return slopes if known.all() else np.where(known, slopes, 0.0)


def free(x: Array, gradient: Array, lower: Array, upper: Array) -> NDArray[np.bool_]:
    """Return a mask, (n,), of the variables that the gradient does not push against a bound."""
    pressed = ((x <= lower) & (gradient >= 0.0)) | ((x >= upper) & (gradient <= 0.0))
    return ~pressed


def printed_step(gradient: Array, damping: float) -> tuple[Array, float]:
    """Eq. 12: return the step s = -(g gᵀ + γ I)⁻¹ g, and the change gᵀs that it predicts.

    Apart from γ I the matrix has rank one, so s = -g / (γ + gᵀg) (Sherman and Morrison).
    """
    squared = gradient @ gradient
    return gradient / -(damping + squared), float(-squared / (damping + squared))


def newton_step(normal: Array, gradient: Array, moves: NDArray[np.bool_], damping: float) -> Array:
    """Solve (N + γ I) s = -g / 2 for the free variables, with 0 for the others; return s, (n,).

    The model is f + gᵀs + sᵀNs. For residuals, N = JᵀJ and g = 2 Jᵀe (Levenberg and Marquardt).
    """
    step, size = np.zeros(gradient.size), int(moves.sum())
    matrix = normal[np.ix_(moves, moves)] + damping * np.eye(size)
    try:
        step[moves] = np.linalg.solve(matrix, -0.5 * gradient[moves])
    except np.linalg.LinAlgError:  # the matrix is singular within rounding: the search ends here
        return step
    return np.where(np.isfinite(step), step, 0.0)


def curve(normal: Array, step: Array, change: Array) -> Array:
    """Update half the Hessian, (n, n), by BFGS from the gradient's ``change`` over ``step``."""
    along, bent = float(step @ change), normal @ step
    if not along > 1e-10 * np.linalg.norm(step) * np.linalg.norm(change):
        return normal
    rise, fall = np.outer(change, change) / (2.0 * along), np.outer(bent, bent) / (step @ bent)
    updated: Array = normal + rise - fall
    return updated if np.isfinite(updated).all() else normal


def damped(damping: float, change: float, predicted: float) -> float:
    """Return the next γ: 4 γ if the change is < 0.25 of the predicted change, γ / 2 if > 0.75."""
    ratio = change / predicted if predicted < 0.0 else 0.0
    if ratio > 0.75:
        return max(damping / 2.0, _SMALLEST_DAMPING)
    if ratio >= 0.25:
        return damping
    return min(damping * 4.0, _LARGEST_DAMPING)


def ends(x: Array, lower: Array, upper: Array) -> Array:
    """Return 2n clones of ``x``: each variable once at its least and once at its greatest value.

    This is ours, not the paper's. If a local search is trapped, the way out often begins at a
    bound. A search that is stuck at one limit of a joint restarts from the other limit. If an arm
    is nearly straight, it restarts from the limit where the elbow bends backwards. An arm with its
    shoulder turned by 180° and its elbow bent the other way puts the hand in nearly the same place.
    """
    clones, j = np.repeat(x[None], 2 * x.size, axis=0), np.arange(x.size)
    clones[2 * j, j], clones[2 * j + 1, j] = lower, upper
    return clones


def promising(x: Array, lower: Array, upper: Array, values: Array) -> Ints:
    """Return the indices of the clones of :func:`ends`, the most promising first.

    Clones whose changed variable was at a bound come first, then the others, both sorted by value.
    ``x`` itself and points that are not allowed are left out.
    """
    at_least, at_most = x <= lower, x >= upper
    here = np.column_stack([at_least, at_most]).ravel()
    at_end = np.repeat(at_least | at_most, 2)
    order = np.lexsort((values, ~at_end))
    return order[(~here & (values < np.inf))[order]]
