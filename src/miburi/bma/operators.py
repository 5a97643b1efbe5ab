"""The operators of the Bacterial Memetic Algorithm (Section 3), compiled.

None of them evaluates anything: :mod:`miburi.bma` applies them around any function written in
Python, :mod:`miburi.ik.kernel` around the kinematics. Importing this module loads Numba; what it
compiles is kept on the disk.
"""

import numpy as np
from numpy.typing import NDArray

from miburi.ground.compiled import compiled

__all__ = [
    "SLIGHT",
    "SWEEPS",
    "TINY",
    "Array",
    "Ints",
    "State",
    "below",
    "clamped",
    "damped",
    "differences",
    "ends",
    "hold",
    "hopeless",
    "inside",
    "into_box",
    "length",
    "most_promising",
    "mutate",
    "populate",
    "printed_step",
    "rank",
    "residual_step",
    "shuffle",
    "square",
    "stencil",
    "transfer",
    "uniform",
]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
State = NDArray[np.uint64]

#: A gain by a smaller share does not count as one.
SLIGHT = 1e-6
#: A local search sets out from the ends at most this many times.
SWEEPS = 3
#: A pivot counts as at least this.
TINY = 1e-300

_STENCIL = 1e-6  # half width of a central difference, as a share of a variable's range
_FINEST = 1e-14  # and no less than this share of the variable itself, to differ from it
_SMALLEST_DAMPING, _LARGEST_DAMPING = 1e-15, 1e15


@compiled
def uniform(state: State) -> float:
    """Draw from [0, 1) by SplitMix64 (Steele, Lea and Flood 2014); ``state`` is one number."""
    state[0] += np.uint64(0x9E3779B97F4A7C15)
    z = state[0]
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z ^= z >> np.uint64(31)
    return float(z >> np.uint64(11)) * 2.0**-53


@compiled
def below(state: State, count: int) -> int:
    """Draw one of 0 ... count - 1."""
    return int(uniform(state) * count)


@compiled
def inside(state: State, low: float, high: float) -> float:
    """Draw from the whole range of a variable."""
    return min(max(low + uniform(state) * (high - low), low), high)


@compiled
def populate(population: Array, lower: Array, upper: Array, state: State) -> None:
    """Fill the rows with random bacteria, uniform in the box."""
    for i in range(population.shape[0]):
        for j in range(lower.size):
            population[i, j] = inside(state, lower[j], upper[j])


@compiled
def shuffle(genes: Ints, state: State) -> None:
    """Put the numbers of the variables in random order (Fisher and Yates)."""
    for i in range(genes.size - 1, 0, -1):
        j = below(state, i + 1)
        genes[i], genes[j] = genes[j], genes[i]


@compiled
def mutate(
    bacterium: Array, segment: Ints, lower: Array, upper: Array, state: State, clones: Array
) -> None:
    """Bacterial mutation: fill the rows with copies of a bacterium, new in its ``segment``."""
    for i in range(clones.shape[0]):
        for j in range(bacterium.size):
            clones[i, j] = bacterium[j]
        for gene in segment:
            clones[i, gene] = inside(state, lower[gene], upper[gene])


@compiled
def rank(population: Array, costs: Array) -> None:
    """Sort the bacteria, best first; equals keep their order (insertion sort)."""
    for i in range(1, costs.size):
        j = i
        while j > 0 and costs[j] < costs[j - 1]:
            costs[j], costs[j - 1] = costs[j - 1], costs[j]
            for k in range(population.shape[1]):
                population[j, k], population[j - 1, k] = population[j - 1, k], population[j, k]
            j -= 1


@compiled
def transfer(population: Array, count: int, genes: Ints, state: State) -> int:
    """Gene transfer within a ranked population; return the number of the changed bacterium.

    A random one of the better half gives ``count`` random genes to a random one of the worse.
    """
    individuals = population.shape[0]
    half = individuals // 2
    giver = below(state, half)
    taker: int = half + below(state, individuals - half)
    for k in range(min(count, genes.size)):
        pick = k + below(state, genes.size - k)
        genes[k], genes[pick] = genes[pick], genes[k]
        population[taker, genes[k]] = population[giver, genes[k]]
    return taker


@compiled
def stencil(x: Array, lower: Array, upper: Array, points: Array) -> None:
    """Write the two neighbours of ``x`` along each variable, (2n, n), never outside the box."""
    for j in range(x.size):
        half = max(_STENCIL * (upper[j] - lower[j]), _FINEST * abs(x[j]))
        for k in range(x.size):
            points[2 * j, k] = x[k]
            points[2 * j + 1, k] = x[k]
        points[2 * j, j] = min(x[j] + half, upper[j])
        points[2 * j + 1, j] = max(x[j] - half, lower[j])


@compiled
def differences(x: Array, centre: Array, points: Array, values: Array, jacobian: Array) -> None:
    """Second-order central differences (Section 3) of the (2n, m) values at a :func:`stencil`.

    Where the box cuts a neighbour off, or its value is infinite, the difference is one-sided, to
    the values ``centre``, (m,), at ``x``. Writes (m, n).
    """
    for j in range(points.shape[1]):
        above, below = 2 * j, 2 * j + 1
        for i in range(values.shape[1]):
            high, low = values[above, i], values[below, i]
            width = points[above, j] - points[below, j]
            if not abs(high) < np.inf:
                high, width = centre[i], x[j] - points[below, j]
            elif not abs(low) < np.inf:
                low, width = centre[i], points[above, j] - x[j]
            slope = (high - low) / width if width > 0.0 else 0.0
            jacobian[i, j] = slope if abs(slope) < np.inf else 0.0


@compiled
def square(jacobian: Array, residual: Array, normal: Array, gradient: Array) -> None:
    """Write JᵀJ and the gradient of the sum of squares, 2 Jᵀe."""
    rows, variables = jacobian.shape
    for j in range(variables):
        for k in range(j + 1):
            total = 0.0
            for i in range(rows):
                total += jacobian[i, j] * jacobian[i, k]
            normal[j, k] = total
            normal[k, j] = total
        total = 0.0
        for i in range(rows):
            total += jacobian[i, j] * residual[i]
        gradient[j] = 2.0 * total


@compiled
def length(vector: Array) -> float:
    """Return the Euclidean norm."""
    total = 0.0
    for j in range(vector.size):
        total += vector[j] * vector[j]
    return float(np.sqrt(total))


@compiled
def hold(x: Array, gradient: Array, lower: Array, upper: Array, free: Array) -> float:
    """Write 0 for each variable that the gradient presses on a bound, 1 for the others.

    Returns the gradient's length over those others.
    """
    total = 0.0
    for j in range(x.size):
        slope = gradient[j]
        pressed = (x[j] <= lower[j] and slope >= 0.0) or (x[j] >= upper[j] and slope <= 0.0)
        free[j] = 0.0 if pressed else 1.0
        total += free[j] * slope * slope
    return float(np.sqrt(total))


@compiled
def clamped(value: float, low: float, high: float, otherwise: float) -> float:
    """Return the value put back between its bounds; ``otherwise`` where it is no number."""
    return min(max(value, low), high) if value == value else otherwise  # noqa: PLR0124  (NaN differs from itself)


@compiled
def printed_step(
    x: Array, gradient: Array, damping: float, lower: Array, upper: Array, new: Array
) -> float:
    """Eq. 12: write x - (g gᵀ + γ I)⁻¹ g; return gᵀs, the change that its ratio divides by.

    The matrix has rank one beside γ I, so that s = -g / (γ + gᵀg) (Sherman and Morrison). The
    paper does not say what happens at the limits; here the point is put back into the box.
    """
    squared = 0.0
    for j in range(x.size):
        squared += gradient[j] * gradient[j]
    for j in range(x.size):
        new[j] = clamped(x[j] - gradient[j] / (damping + squared), lower[j], upper[j], x[j])
    return -squared / (damping + squared)


@compiled
def residual_step(
    normal: Array, gradient: Array, free: Array, damping: float, matrix: Array, step: Array
) -> None:
    """Levenberg-Marquardt on residuals: solve (JᵀJ + γ I) s = -Jᵀe over the free variables.

    Of ``normal``, JᵀJ, the lower triangle is read; ``gradient`` is 2 Jᵀe; ``matrix`` (n, n) is
    working memory. L D Lᵀ, from the last variable to the first.
    """
    n = step.size
    for j in range(n):
        for k in range(j):
            matrix[j, k] = free[j] * free[k] * normal[j, k]
        matrix[j, j] = normal[j, j] + damping
        step[j] = -0.5 * free[j] * gradient[j]
    for k in range(n - 1, -1, -1):
        matrix[k, k] = 1.0 / max(matrix[k, k], TINY)
        for j in range(k):
            factor = matrix[k, j] * matrix[k, k]
            for i in range(j + 1):
                matrix[j, i] -= factor * matrix[k, i]
            step[j] -= factor * step[k]
    for k in range(n):
        total = step[k]
        for j in range(k):
            total -= matrix[k, j] * step[j]
        step[k] = total * matrix[k, k]


@compiled
def into_box(
    x: Array,
    normal: Array,
    gradient: Array,
    damping: float,
    lower: Array,
    upper: Array,
    step: Array,
    new: Array,
) -> float:
    """Write x + s, put back into the box; return the change that the model of residuals predicts.

    What is left of the step inside the box takes the place of ``step``.
    """
    cut = False
    slope = moved = 0.0
    for j in range(x.size):
        new[j] = clamped(x[j] + step[j], lower[j], upper[j], x[j])
        cut |= new[j] != x[j] + step[j]
        step[j] = new[j] - x[j]
        slope += gradient[j] * step[j]
        moved += step[j] * step[j]
    if not cut:  # here sᵀ JᵀJ s follows from the equation that s solves
        return 0.5 * slope - damping * moved
    predicted = slope
    for j in range(x.size):
        row = 0.5 * normal[j, j] * step[j]
        for k in range(j):
            row += normal[j, k] * step[k]
        predicted += 2.0 * row * step[j]
    return predicted


@compiled
def damped(damping: float, change: float, predicted: float) -> float:
    """Return the next γ: fourfold where the ratio is below 0.25, half where above 0.75."""
    ratio = change / predicted if predicted < 0.0 else 0.0
    if ratio > 0.75:
        return max(damping / 2.0, _SMALLEST_DAMPING)
    if ratio >= 0.25:
        return damping
    return min(damping * 4.0, _LARGEST_DAMPING)


@compiled
def hopeless(value: float, gain: float, best: float) -> bool:
    """Whether a local search should give up after a step that gained ``gain``.

    It should where a thousand such gains would not bring it to the best value known, and where
    the gain is next to nothing. This is ours, not the paper's.
    """
    return value - 1e3 * gain > best or gain <= 1e-8 * value


@compiled
def ends(x: Array, lower: Array, upper: Array, clones: Array) -> None:
    """Write 2n clones of ``x``: each variable once at its least and once at its greatest value.

    This is ours, not the paper's. Where a local search is trapped, the way out often begins at
    an end: of a joint on its limit at the other limit, since a turn by half a circle leads to
    nearly the same place; of a nearly straight arm at the limit that bends it the other way.
    """
    for j in range(x.size):
        for k in range(x.size):
            clones[2 * j, k] = x[k]
            clones[2 * j + 1, k] = x[k]
        clones[2 * j, j] = lower[j]
        clones[2 * j + 1, j] = upper[j]


@compiled
def most_promising(x: Array, lower: Array, upper: Array, values: Array, tried: Ints) -> int:
    """Choose among the clones of :func:`ends` the next to search from; -1 where none is left.

    First those of variables that are at an end, then the others, each by its value.
    """
    chosen = -1
    first = False
    for i in range(values.size):
        j = i // 2
        at_end = x[j] <= lower[j] or x[j] >= upper[j]
        here = (x[j] <= lower[j]) if i % 2 == 0 else (x[j] >= upper[j])
        if here or tried[i] or not values[i] < np.inf:
            continue
        if chosen < 0 or (at_end and not first) or (at_end == first and values[i] < values[chosen]):
            chosen, first = i, at_end
    return chosen
