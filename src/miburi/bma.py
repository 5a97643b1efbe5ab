"""The Bacterial Memetic Algorithm (Section 3): minimise any function in a box.

>>> from miburi import bma
>>> result = bma.minimize(lambda x: (x[0] - 1) ** 2 + x[1] ** 2, [(-2, 2), (-2, 2)], seed=1)
>>> result.status
'converged'

For a function that is expensive, or lives elsewhere, ask for points and tell their values:

>>> search = bma.Optimizer([(-2, 2), (-2, 2)], seed=1)
>>> while not search.finished:
...     points = search.ask()
...     search.tell([(x - 1) ** 2 + y**2 for x, y in points])
"""

import time
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from types import ModuleType
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from miburi.errors import InputError

Array = NDArray[np.float64]
Seed = int | np.random.Generator
Operator = Literal["mutation", "local search", "gene transfer"]

#: Why a search ended, in words.
CONVERGED = "converged"
SETTLED = "settled: no better value found"
BUDGET_SPENT = "budget spent"
DEADLINE = "stopped by deadline"

_OPERATORS: tuple[Operator, ...] = ("mutation", "local search", "gene transfer")
_PAPER_ORDER = _OPERATORS
_LOCAL_FIRST: tuple[Operator, ...] = ("local search", "gene transfer", "mutation")


@dataclass(frozen=True)
class Settings:
    """How the algorithm works; the paper's numbers are those of Table 2.

    The default keeps Table 2 and changes what follows it, which is ours: a local search from the
    starting point comes before everything else, each generation begins with local searches, and
    the search ends at ``target`` or once it has settled. :meth:`paper` changes nothing.

    Parameters
    ----------
    generations
        N_gen, at most this many, from 0.
    individuals
        N_ind, from 2.
    clones
        N_clones, from 2; one of them stays as the original is.
    segment
        l_bm, variables in a segment of bacterial mutation, from 1.
    transfers
        N_inf, gene transfers in a generation, from 0.
    transferred
        l_gt, variables in a gene transfer, from 1.
    local_probability
        LM_prob, 0 to 1.
    local_iterations
        LM_iter, from 0.
    damping
        γ_init, above 0.
    gradient_tolerance
        τ: a local search ends where the gradient is shorter, from 0.
    local_search
        "gradient" is Eq. 12 as printed; "residual" is Levenberg-Marquardt on the residuals,
        (JᵀJ + γI)s = -Jᵀe, as in the paper's reference [9], for functions that return residuals.
    order
        The operators in the order in which a generation applies them.
    first_iterations
        Iterations of the local search from the starting point, before the population is made;
        0 leaves it out, as the paper does.
    target
        The search has converged at a value not above this; ``-inf`` never stops it.
    patience
        The search has settled after this many generations without a better value; 0 never
        stops it, as in the paper.

    Raises
    ------
    InputError
        A value is not allowed; the message says what is.
    """

    generations: int = 35
    individuals: int = 12
    clones: int = 10
    segment: int = 1
    transfers: int = 15
    transferred: int = 1
    local_probability: float = 0.2
    local_iterations: int = 8
    damping: float = 1.0
    gradient_tolerance: float = 1e-4
    local_search: Literal["gradient", "residual"] = "gradient"
    order: tuple[Operator, ...] = _LOCAL_FIRST
    first_iterations: int = 8
    target: float = 1e-12
    patience: int = 0

    def __post_init__(self) -> None:
        for name, least in _SMALLEST.items():
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or value < least:
                raise InputError(f"{name} must be a whole number from {least}, got {value!r}.")
        for name, (low, high) in _RANGES.items():
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise InputError(f"{name} must be a number, got {value!r}.")
            if not low <= value <= high:
                raise InputError(f"{name} must lie from {low} to {high}, got {value}.")
        if self.local_search not in ("gradient", "residual"):
            raise InputError(
                f'local_search must be "gradient" or "residual", got {self.local_search!r}.'
            )
        if not isinstance(self.order, tuple) or not set(self.order) <= set(_OPERATORS):
            raise InputError(f"order must be a tuple of {_OPERATORS}, got {self.order!r}.")

    @classmethod
    def paper(cls) -> Self:
        """Table 2 and Section 3 as printed: Eq. 12, mutation first, all 35 generations."""
        return cls(order=_PAPER_ORDER, first_iterations=0, target=-np.inf, patience=0)


_SMALLEST = {
    "generations": 0,
    "individuals": 2,
    "clones": 2,
    "segment": 1,
    "transfers": 0,
    "transferred": 1,
    "local_iterations": 0,
    "first_iterations": 0,
    "patience": 0,
}
_TINY, _HUGE = 1e-300, 1e300
_RANGES = {
    "local_probability": (0.0, 1.0),
    "damping": (_TINY, _HUGE),
    "gradient_tolerance": (0.0, _HUGE),
    "target": (-np.inf, _HUGE),
}


@dataclass(frozen=True)
class Result:
    """What a search found.

    Parameters
    ----------
    x
        The best point, (n,), inside the bounds.
    value
        The function there (of residuals, the sum of squares).
    evaluations
        How many points were evaluated.
    generations
        How many generations were finished.
    status
        Why it ended: one of ``CONVERGED``, ``SETTLED``, ``BUDGET_SPENT``, ``DEADLINE``.
    """

    x: Array
    value: float
    evaluations: int
    generations: int
    status: str


class Optimizer:
    """The algorithm with the function left out: ask for points, tell their values.

    Parameters
    ----------
    bounds
        (n, 2): the least and greatest value of each variable.
    start
        (n,) inside the bounds; the middle of the box where none is given.
    settings
        How to search.
    seed
        A whole number from 0, or a NumPy generator.

    Raises
    ------
    InputError
        Bounds, start or seed are not as said above.
    """

    def __init__(
        self,
        bounds: ArrayLike,
        *,
        start: ArrayLike | None = None,
        settings: Settings | None = None,
        seed: Seed = 0,
    ) -> None:
        self.settings = settings or Settings()
        self.lower, self.upper = _checked_bounds(bounds)
        self.start = _checked_start(start, self.lower, self.upper)
        self._state = np.array([seed_of(seed)], dtype=np.uint64)
        self._genes = np.arange(self.lower.size)
        self._value, self._x = np.inf, self.start.copy()
        self._evaluations = self._generations = 0
        self._status: str | None = None
        self._points: Array | None = None
        self._told: Array | None = None
        self._requests = self._search()
        self._advance()

    @property
    def finished(self) -> bool:
        """Whether the search has ended."""
        return self._status is not None

    @property
    def result(self) -> Result:
        """The best so far; before the end its status is ``BUDGET_SPENT``."""
        return Result(
            self._x.copy(),
            float(self._value),
            self._evaluations,
            self._generations,
            self._status or BUDGET_SPENT,
        )

    def ask(self) -> Array:
        """Return the points, (k, n), whose values are wanted next.

        Raises
        ------
        InputError
            The search has ended.
        """
        if self._points is None:
            raise InputError("The search has ended; its result is in .result.")
        return self._points.copy()

    def tell(self, values: ArrayLike) -> None:
        """Give the values, (k,), of the points last asked for, or their residuals, (k, m).

        Raises
        ------
        InputError
            The shape is another, a value is NaN, or the search has ended.
        """
        points = self.ask()
        told = np.asarray(values, dtype=np.float64)
        if told.ndim not in (1, 2) or len(told) != len(points):
            raise InputError(
                f"tell() needs {len(points)} values, one for each point asked for, "
                f"got the shape {told.shape}."
            )
        if self.settings.local_search == "residual" and told.ndim == 1:
            raise InputError(
                'local_search="residual" needs a function that returns residuals, (m,); '
                'got one number. Return residuals, or choose local_search="gradient".'
            )
        if self._told is not None and told.shape[1:] != self._told.shape[1:]:
            raise InputError(
                f"The function returned the shape {told.shape[1:]}, "
                f"before it was {self._told.shape[1:]}."
            )
        wrong = np.isnan(told.reshape(len(told), -1)).any(axis=1)
        if wrong.any():
            raise InputError(
                f"The function returned NaN at x = {points[wrong][0].tolist()}. Return inf "
                "where a point is not allowed, or narrow the bounds."
            )
        self._told = told
        totals = self._totals()
        self._evaluations += len(points)
        best = int(np.argmin(totals))
        if totals[best] < self._value:
            self._value, self._x = float(totals[best]), points[best]
        if self._value <= self.settings.target:
            self._end(CONVERGED)
        else:
            self._advance()

    def stop(self, status: str) -> None:
        """End the search here; ``status`` says why."""
        if not self.finished:
            self._end(status)

    def _end(self, status: str) -> None:
        self._status, self._points = status, None
        self._requests.close()

    def _advance(self) -> None:
        """Run up to the next request for values."""
        try:
            self._points = next(self._requests)
        except StopIteration as ended:
            self._end(ended.value)

    def _search(self) -> Generator[Array, None, str]:
        """Yield points; when it goes on, their values have been told. Return the status."""
        settings = self.settings
        yield self.start[None]
        if settings.first_iterations:
            alone, value = self.start[None].copy(), np.array([self._value])
            yield from self._local_search(alone, value, 0, settings.first_iterations)
        population = np.empty((settings.individuals, self.lower.size))
        operators().populate(population, self.lower, self.upper, self._state)
        population[0] = self._x
        yield population
        costs = self._totals().copy()
        idle = 0
        for _ in range(settings.generations):
            before = self._value
            for operator in settings.order:
                if operator == "mutation":
                    yield from self._mutation(population, costs)
                elif operator == "local search":
                    yield from self._local_searches(population, costs)
                else:
                    yield from self._gene_transfer(population, costs)
            self._generations += 1
            idle = 0 if self._value < before else idle + 1
            if settings.patience and idle >= settings.patience:
                return SETTLED
        return BUDGET_SPENT

    def _mutation(self, population: Array, costs: Array) -> Iterator[Array]:
        """Bacterial mutation of every bacterium, segment by segment in random order.

        The clones are alike whenever a segment's turn comes, so one row stands for all of them.
        """
        clones = np.empty((self.settings.clones - 1, self.lower.size))
        for i, bacterium in enumerate(population):
            operators().shuffle(self._genes, self._state)
            for first in range(0, len(self._genes), self.settings.segment):
                segment = self._genes[first : first + self.settings.segment]
                operators().mutate(bacterium, segment, self.lower, self.upper, self._state, clones)
                yield clones
                totals = self._totals()
                best = int(np.argmin(totals))
                if totals[best] < costs[i]:
                    costs[i], bacterium[:] = totals[best], clones[best]

    def _local_searches(self, population: Array, costs: Array) -> Iterator[Array]:
        for i in range(len(population)):
            if operators().uniform(self._state) < self.settings.local_probability:
                yield from self._local_search(population, costs, i, self.settings.local_iterations)

    def _local_search(
        self, population: Array, costs: Array, i: int, iterations: int
    ) -> Iterator[Array]:
        """Improve one bacterium: Eq. 12, or Levenberg-Marquardt on the residuals."""
        x, lower, upper = population[i], self.lower, self.upper
        n, by_residual = len(x), self.settings.local_search == "residual"
        points, new, gradient = np.empty((2 * n, n)), np.empty((1, n)), np.empty(n)
        normal, matrix = np.empty((n, n)), np.empty((n, n))
        damping, accepted = self.settings.damping, True
        for _ in range(iterations):
            if accepted and by_residual:
                yield x[None]
                residual = self._rows()[0].copy()
            if accepted:
                operators().stencil(x, lower, upper, points)
                yield points
                rows = self._rows() if by_residual else self._totals()[:, None]
                jacobian = np.empty((rows.shape[1], n))
                operators().differences(points, rows, jacobian)
                if by_residual:
                    operators().square(jacobian, residual, normal, gradient)
                    size = operators().free_length(x, gradient, lower, upper)
                else:
                    gradient[:] = jacobian[0]
                    size = operators().length(gradient)
            if size <= self.settings.gradient_tolerance:
                return
            if by_residual:
                predicted = operators().residual_step(
                    x, normal, gradient, damping, lower, upper, matrix, new[0]
                )
            else:
                predicted = operators().printed_step(x, gradient, damping, lower, upper, new[0])
            yield new
            change = self._totals()[0] - costs[i]
            damping = operators().damped(damping, change, predicted)
            accepted = change < 0
            if accepted:
                costs[i], x[:] = self._totals()[0], new[0]

    def _gene_transfer(self, population: Array, costs: Array) -> Iterator[Array]:
        operators().rank(population, costs)
        for _ in range(self.settings.transfers):
            taker = operators().transfer(
                population, self.settings.transferred, self._genes, self._state
            )
            yield population[taker, None]
            costs[taker] = self._totals()[0]
            operators().rank(population, costs)

    def _rows(self) -> Array:
        """Return the residuals last told, (k, m)."""
        assert self._told is not None and self._told.ndim == 2  # noqa: S101, PT018
        return self._told

    def _totals(self) -> Array:
        """Return the values last told, (k,); of residuals, the sums of squares."""
        assert self._told is not None  # noqa: S101
        return self._told if self._told.ndim == 1 else np.einsum("ij,ij->i", *2 * [self._told])


def operators() -> ModuleType:
    """Return the compiled operators; loads Numba when first called."""
    from miburi import bma_operators

    return bma_operators


def minimize(
    function: Callable[[Array], Any],
    bounds: ArrayLike,
    *,
    start: ArrayLike | None = None,
    settings: Settings | None = None,
    seed: Seed = 0,
    deadline: float | None = None,
    callback: Callable[[Result], bool | None] | None = None,
) -> Result:
    """Find the least value of a function in a box.

    Parameters
    ----------
    function
        Takes a point, (n,), and returns a number, or residuals, (m,), whose sum of squares is
        minimised. Infinity marks a point that is not allowed.
    bounds
        (n, 2): the least and greatest value of each variable; the function is never called
        outside.
    start
        (n,) inside the bounds; the middle of the box where none is given.
    settings
        How to search; :class:`Settings` where none is given.
    seed
        A whole number from 0, or a NumPy generator: the same seed gives the same result.
    deadline
        Seconds after which the best so far is returned, above 0.
    callback
        Called after each generation with the best so far; a true return ends the search.

    Raises
    ------
    InputError
        An argument is not as said above, or the function returned NaN.
    """
    limit = clock_limit(deadline)
    search = Optimizer(bounds, start=start, settings=settings, seed=seed)
    generations = 0
    while not search.finished:
        search.tell([function(point) for point in search.ask()])
        if callback is not None and search.result.generations > generations:
            generations = search.result.generations
            if callback(search.result):
                search.stop("stopped by callback")
        if time.perf_counter() >= limit:
            search.stop(DEADLINE)
    return search.result


def clock_limit(deadline: float | None) -> float:
    """When ``deadline`` seconds from now will have passed, on the clock of ``perf_counter``.

    Raises
    ------
    InputError
        The deadline is not above 0.
    """
    if deadline is None:
        return np.inf
    if not deadline > 0:
        raise InputError(f"deadline must be above 0 s, got {deadline!r}.")
    return time.perf_counter() + deadline


def seed_of(seed: Seed) -> int:
    """Return the number from 0 to 2**63 - 1 that a seed or a generator stands for.

    Raises
    ------
    InputError
        The seed is neither such a number nor a NumPy generator.
    """
    if isinstance(seed, np.random.Generator):
        return int(seed.integers(1 << 63))
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or not 0 <= seed < 1 << 63:
        raise InputError(
            f"seed must be a whole number from 0 to 2**63 - 1, or a NumPy generator, got {seed!r}."
        )
    return int(seed)


def order_of(settings: Settings) -> list[int]:
    """Return the operators of a generation by their numbers."""
    return [_OPERATORS.index(operator) for operator in settings.order]


def _checked_bounds(bounds: ArrayLike) -> tuple[Array, Array]:
    try:
        box = np.array(bounds, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"bounds must be pairs of numbers, got {bounds!r}.") from error
    if box.ndim != 2 or box.shape[1] != 2 or not len(box):
        raise InputError(f"bounds must have the shape (n, 2), got {box.shape}.")
    if not np.all(np.isfinite(box)) or not np.all(box[:, 0] < box[:, 1]):
        raise InputError(
            f"bounds must be finite, each least value below its greatest, got {bounds!r}."
        )
    return box[:, 0].copy(), box[:, 1].copy()


def _checked_start(start: ArrayLike | None, lower: Array, upper: Array) -> Array:
    if start is None:
        return np.clip((lower + upper) / 2, lower, upper)
    point = np.array(start, dtype=np.float64)
    if point.shape != lower.shape:
        raise InputError(f"start must have the shape {lower.shape}, got {point.shape}.")
    if not (np.all(point >= lower) and np.all(point <= upper)):
        raise InputError(f"start must lie inside the bounds, got {start!r}.")
    return point
