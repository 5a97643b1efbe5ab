"""The search itself: the algorithm's loop, for any function in a box."""

from collections.abc import Callable, Generator

import numpy as np
from numpy.typing import ArrayLike

from miburi.bma import operators as op
from miburi.bma.local import Jacobian, Problem, search_locally
from miburi.bma.settings import (
    BUDGET_SPENT,
    CONVERGED,
    NOTHING_ALLOWED,
    SETTLED,
    Array,
    SearchResult,
    Settings,
    checked_settings,
)
from miburi.errors import InputError
from miburi.ground.arguments import Seed, real_numbers, seed_of

_EXACT = 1e-20  # a search by residuals has converged below this share of its first sum of squares
_IDLE = 1e-12  # a gain smaller than this share of the first generation's spread does not count

#: Yields points; is sent the function's results at these points.
Requests = Generator[Array, Array, None]


class Optimizer:
    """The algorithm without the function: ask it for points, and tell it their values.

    Parameters
    ----------
    bounds
        (n, 2): the lower and upper bound of each variable. Equal bounds fix the variable.
    start
        The point, (n,), inside the bounds, at which the first local search begins; by default the
        middle of the box.
    settings
        How to search.
    seed
        A whole number, 0 or more, or a NumPy generator.
    jacobian
        Maps a point to the derivatives of the residuals, (m, n), or of the value, (n,). Without it,
        derivatives are central differences.

    Raises
    ------
    InputError
        Bounds, start or seed are not as described above.
    """

    def __init__(
        self,
        bounds: ArrayLike,
        *,
        start: ArrayLike | None = None,
        settings: Settings | None = None,
        seed: Seed = 0,
        jacobian: Jacobian | None = None,
    ) -> None:
        self.settings = checked_settings(settings)
        self.lower, self.upper = _checked_bounds(bounds)
        self.start = _checked_start(start, self.lower, self.upper)
        self._problem = Problem(self.lower, self.upper, self.settings, jacobian)
        self._begins_at_start = start is not None or self.settings.first_iterations > 0
        self._state = np.array([seed_of(seed)], dtype=np.uint64)
        self._genes = list(range(self.lower.size))
        self._value, self._x, self._enough = np.inf, self.start.copy(), -np.inf
        self._evaluations = self._generations = self._idle = 0
        self._status: str | None = None
        self._told_shape: tuple[int, ...] = ()
        # The latest values passed to ``tell``; for residuals, their sums of squares.
        self._totals = np.empty(0)
        self._asked = False
        self._requests = self._search()
        self._points: Array | None = next(self._requests)

    @property
    def finished(self) -> bool:
        """Whether the search has ended."""
        return self._status is not None

    @property
    def result(self) -> SearchResult:
        """The best result so far; before the end its status is ``BUDGET_SPENT``."""
        status, counts = self._status or BUDGET_SPENT, (self._evaluations, self._generations)
        return SearchResult(self._x.copy(), float(self._value), *counts, status)

    def ask(self) -> Array:
        """Return the points, (k, n), whose values are wanted next.

        Raises InputError after the search has ended.
        """
        if self._points is None:
            raise InputError("The search has ended; its result is in .result.")
        self._asked = True
        return self._points.copy()

    def tell(self, values: ArrayLike) -> None:
        """Give the values, (k,), of the points last asked for, or their residuals, (k, m).

        Raises
        ------
        InputError
            The shape is wrong, a value is NaN, no points were asked for, or the search has ended.
        """
        if not (self.finished or self._asked):
            raise InputError("Tell values once, and only for points asked for: call ask() first.")
        points = self.ask()
        self._take(points, self._checked_values(values, points))

    def follow(self, function: Callable[[Array], Array]) -> bool:
        """Ask and tell once, without checks; return whether the search goes on.

        ``function`` takes (k, n) and returns finite residuals, (k, m).
        """
        if self._points is not None:
            self._take(self._points, function(self._points))
        return self._points is not None

    def _take(self, points: Array, told: Array) -> None:
        """Keep the values, and run up to the next request for values."""
        self._told_shape, self._asked = told.shape[1:], False
        self._totals = totals = told if told.ndim == 1 else np.einsum("ij,ij->i", told, told)
        if not self._evaluations:
            self._enough = self._target(totals, of_residuals=told.ndim == 2)
        self._evaluations += len(points)
        best = int(totals.argmin())
        if totals[best] < self._value:
            self._value, self._x = float(totals[best]), points[best].copy()
        if self._value <= self._enough:
            self._end(CONVERGED)
            return
        seen = told if self._problem.by_residual else totals[:, None]
        try:
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                self._points = self._requests.send(seen)
        except StopIteration as ended:
            self._end(ended.value)

    def _target(self, totals: Array, *, of_residuals: bool) -> float:
        """Return the value that counts as converged; ``totals`` are costs of the first points."""
        if self.settings.target is not None:
            return self.settings.target
        if not of_residuals:
            return -np.inf
        known = totals[np.isfinite(totals)]
        return _EXACT * float(np.median(known)) if known.size else 0.0

    def _checked_values(self, values: ArrayLike, points: Array) -> Array:
        by_residual = self._problem.by_residual
        wanted = "real numbers, or residuals of the same shape (m,) each time"
        told = real_numbers(values, "the function's values", wanted)
        if told.ndim == 2 and told.shape[1] == 1 and not by_residual:
            told = told[:, 0].copy()  # an array of one number counts as a number
        if told.ndim not in (1, 2) or len(told) != len(points) or not told.size:
            wanted = f"{len(points)} values, one for each point asked for"
            raise InputError(f"tell() needs {wanted}, got the shape {told.shape}.")
        if by_residual and told.ndim == 1:
            raise InputError(
                'local_search="residual" needs a function that returns residuals, (m,); '
                'got one number. Return residuals, or choose local_search="gradient".'
            )
        if self._evaluations and told.shape[1:] != self._told_shape:
            shapes = f"{told.shape[1:]}, but earlier {self._told_shape}"
            raise InputError(f"The function returned the shape {shapes}.")
        wrong = np.isnan(told.reshape(len(told), -1)).any(axis=1)
        if wrong.any():
            raise InputError(
                f"The function returned NaN at x = {points[wrong][0].tolist()}. Return inf "
                "where a point is not allowed, or narrow the bounds."
            )
        return told

    def stop(self, status: str) -> None:
        """End the search here; ``status`` says why."""
        if not self.finished:
            self._end(status)

    def _end(self, status: str) -> None:
        nothing = self._value == np.inf and status in (BUDGET_SPENT, SETTLED)
        self._status, self._points = NOTHING_ALLOWED if nothing else status, None
        self._requests.close()

    def _search(self) -> Generator[Array, Array, str]:
        """Yield points, receive the function's results at them, and return the status."""
        settings, lower, upper = self.settings, self.lower, self.upper
        if self._begins_at_start:
            told = yield self.start[None]
        middle = _middle(lower, upper)
        for first in (self.start, middle) if settings.first_iterations else ():
            if first is middle:
                if (middle == self.start).all():
                    break
                told = yield middle[None]
            _, linear = yield from search_locally(
                self._problem, first.copy(), told[0], self._value, settings.first_iterations
            )
            if linear:
                return CONVERGED
        shares = op.draw(self._state, settings.individuals * lower.size).reshape(-1, lower.size)
        population = np.clip(lower + shares * (upper - lower), lower, upper)
        if self._begins_at_start:
            population[-1] = self._x
        yield population
        costs = self._totals.copy()
        allowed = costs[np.isfinite(costs)]
        slight = _IDLE * float(np.ptp(allowed)) if allowed.size else 0.0
        for _ in range(settings.generations):
            self._generations += 1
            if not settings.local_first:
                yield from self._mutation(population, costs)
            yield from self._local_searches(population, costs, slight)
            if 0 < settings.patience <= self._idle:
                return SETTLED
            if settings.local_first:
                yield from self._mutation(population, costs)
            yield from self._gene_transfer(population, costs)
        return BUDGET_SPENT

    def _mutation(self, population: Array, costs: Array) -> Requests:
        """Bacterial mutation of every bacterium, segment by segment in random order.

        One request holds one segment of every bacterium. Before each segment all clones of a
        bacterium are equal, so one row of ``population`` stands for them.
        """
        settings, (bacteria, n) = self.settings, population.shape
        copies, orders = settings.clones - 1, np.empty((bacteria, n), np.int64)
        shares = op.draw(self._state, bacteria * (n - 1 + n * copies)).reshape(bacteria, -1)
        for order, share in zip(orders, shares, strict=True):
            op.shuffle(self._genes, share[: n - 1])
            order[:] = self._genes
        shares = shares[:, n - 1 :]
        for at in range(0, n, settings.segment):
            genes = orders[:, at : at + settings.segment]
            share = shares[:, at * copies :][:, : genes.shape[1] * copies]
            low, high = self.lower[genes][:, None], self.upper[genes][:, None]
            values = low + share.reshape(bacteria, copies, -1) * (high - low)
            values = np.minimum(np.maximum(values, low), high)
            clones = op.mutants(population, genes, values)
            yield clones.reshape(-1, n)
            totals = self._totals.reshape(bacteria, copies)
            best = totals.argmin(axis=1)
            for i in np.flatnonzero(totals.min(axis=1) < costs).tolist():
                costs[i], population[i] = totals[i, best[i]], clones[i, best[i]]

    def _local_searches(self, population: Array, costs: Array, slight: float) -> Requests:
        settings = self.settings
        shares = op.draw(self._state, len(population))
        for i in np.flatnonzero(shares < settings.local_probability).tolist():
            before = self._value
            told = None if self._problem.by_residual else costs[i : i + 1].copy()
            costs[i], _ = yield from search_locally(
                self._problem, population[i], told, before, settings.local_iterations
            )
            least = max(op.SLIGHT * abs(self._value), slight)
            self._idle = 0 if before - self._value > least else self._idle + 1
            if 0 < settings.patience <= self._idle:
                return

    def _gene_transfer(self, population: Array, costs: Array) -> Requests:
        op.rank(population, costs)
        each = 2 + min(self.settings.transferred, self.lower.size)
        shares = op.draw(self._state, self.settings.transfers * each)
        for share in shares.reshape(-1, each):
            taker = op.transfer(population, self._genes, share)
            yield population[taker, None]
            costs[taker] = self._totals[0]
            op.rank(population, costs)


def _checked_bounds(bounds: ArrayLike) -> tuple[Array, Array]:
    box = real_numbers(bounds, "bounds", "pairs of numbers")
    if box.ndim != 2 or box.shape[1] != 2 or not len(box):
        raise InputError(f"bounds must have the shape (n, 2), got {box.shape}.")
    with np.errstate(over="ignore", invalid="ignore"):
        wide = np.isfinite(box[:, 1] - box[:, 0])
    if not np.all(wide) or not np.all(box[:, 0] <= box[:, 1]):
        wanted = "finite and a finite distance apart, with no lower bound above its upper bound"
        raise InputError(f"bounds must be {wanted}, got {bounds!r}.")
    return box[:, 0].copy(), box[:, 1].copy()


def _checked_start(start: ArrayLike | None, lower: Array, upper: Array) -> Array:
    if start is None:
        return _middle(lower, upper)
    point = real_numbers(start, "start", f"{len(lower)} numbers")
    if point.shape != lower.shape:
        raise InputError(f"start must have the shape {lower.shape}, got {point.shape}.")
    if not (np.all(point >= lower) and np.all(point <= upper)):
        raise InputError(f"start must lie inside the bounds, got {start!r}.")
    return point


def _middle(lower: Array, upper: Array) -> Array:
    return np.clip(0.5 * lower + 0.5 * upper, lower, upper)
