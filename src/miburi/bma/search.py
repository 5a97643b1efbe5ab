"""The search itself: the algorithm's loop, for any function in a box."""

from collections.abc import Generator, Iterator
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from miburi.bma.settings import (
    BUDGET_SPENT,
    CONVERGED,
    SETTLED,
    Array,
    SearchResult,
    Seed,
    Settings,
    real_numbers,
    seed_of,
)
from miburi.errors import InputError

__all__ = ["Optimizer", "operators"]


class Optimizer:
    """The algorithm with the function left out: ask for points, tell their values.

    Parameters
    ----------
    bounds
        (n, 2): the least and greatest value of each variable.
    start
        (n,) inside the bounds; where none is given, the first local search begins in the middle
        of the box.
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
        self._begins_at_start = start is not None or self.settings.first_iterations > 0
        self._begun_with = bounds, start, self.settings, seed_of(seed)
        self._state = np.array([self._begun_with[3]], dtype=np.uint64)
        self._genes = np.arange(self.lower.size)
        self._value, self._x = np.inf, self.start.copy()
        self._evaluations = self._generations = self._idle = 0
        self._status: str | None = None
        self._points: Array | None = None
        self._told: Array | None = None
        self._history: list[Array] = []
        self._asked = False
        self._requests = self._search()
        self._advance()

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle what it began with and the values told; :func:`_again` goes the same way."""
        return _again, (*self._begun_with, self._history, self._asked, self._status)

    @property
    def finished(self) -> bool:
        """Whether the search has ended."""
        return self._status is not None

    @property
    def result(self) -> SearchResult:
        """The best so far; before the end its status is ``BUDGET_SPENT``."""
        return SearchResult(
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
        self._asked = True
        return self._points.copy()

    def tell(self, values: ArrayLike) -> None:
        """Give the values, (k,), of the points last asked for, or their residuals, (k, m).

        Raises
        ------
        InputError
            The shape is another, a value is NaN, nothing was asked, or the search has ended.
        """
        if self._points is not None and not self._asked:
            raise InputError("Values are told once, for points asked for: call ask() first.")
        points = self.ask()
        told = self._checked_values(values, points)
        self._history.append(told)
        self._told, self._asked = told, False
        totals = self._totals()
        self._evaluations += len(points)
        best = int(np.argmin(totals))
        if totals[best] < self._value:
            self._value, self._x = float(totals[best]), points[best]
        if self._value <= self.settings.enough(of_residuals=told.ndim == 2):
            self._end(CONVERGED)
        else:
            self._advance()

    def _checked_values(self, values: ArrayLike, points: Array) -> Array:
        """Return the values as the search takes them, or say what is wrong with them."""
        by_residual = self.settings.local_search == "residual"
        try:
            told = real_numbers(values)
        except (TypeError, ValueError) as error:
            raise InputError(
                "The function must return a real number, or residuals, (m,), of which there are "
                f"always as many; got {values!r}."
            ) from error
        if told.ndim == 2 and told.shape[1] == 1 and not by_residual:
            told = told[:, 0].copy()  # an array of one number is that number
        if told.ndim not in (1, 2) or len(told) != len(points) or not told.size:
            raise InputError(
                f"tell() needs {len(points)} values, one for each point asked for, "
                f"got the shape {told.shape}."
            )
        if by_residual and told.ndim == 1:
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
        return told

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
        if self._begins_at_start:
            yield self.start[None]
        if settings.first_iterations:
            x = self.start.copy()
            yield from self._local_search(x, self._value, settings.first_iterations)
            x = _middle(self.lower, self.upper)
            if (x != self.start).any():
                yield x[None]
                value = float(self._totals()[0])
                yield from self._local_search(x, value, settings.first_iterations)
        population = np.empty((settings.individuals, self.lower.size))
        operators().populate(population, self.lower, self.upper, self._state)
        if self._begins_at_start:
            population[-1] = self._x
        yield population
        costs = self._totals().copy()
        for _ in range(settings.generations):
            self._generations += 1
            if not settings.local_first:
                yield from self._mutation(population, costs)
            yield from self._local_searches(population, costs)
            if 0 < settings.patience <= self._idle:
                return SETTLED
            if settings.local_first:
                yield from self._mutation(population, costs)
            yield from self._gene_transfer(population, costs)
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
        for i, bacterium in enumerate(population):
            if operators().uniform(self._state) < self.settings.local_probability:
                before = self._value
                costs[i] = yield from self._local_search(
                    bacterium, costs[i], self.settings.local_iterations
                )
                better = before - self._value > operators().SLIGHT * abs(self._value)
                self._idle = 0 if better else self._idle + 1
                if 0 < self.settings.patience <= self._idle:
                    return

    def _local_search(
        self, x: Array, value: float, iterations: int
    ) -> Generator[Array, None, float]:
        """Improve one bacterium in place; return its value."""
        if value == np.inf and self.settings.local_search == "gradient":
            return value  # a point that is not allowed has no slope
        if self.settings.local_search == "gradient":
            return (yield from self._search_as_printed(x, value, iterations))
        value = yield from self._search_by_residual(x, iterations)
        clones = np.empty((2 * len(x), len(x)))
        for _ in range(operators().SWEEPS if self.settings.ends else 0):
            operators().ends(x, self.lower, self.upper, clones)
            yield clones
            values, tried = self._totals().copy(), np.zeros(len(clones), np.int64)
            for _ in range(self.settings.ends):
                i = operators().most_promising(x, self.lower, self.upper, values, tried)
                if i < 0:
                    return value
                tried[i] = 1
                new = clones[i].copy()
                new_value = yield from self._search_by_residual(new, iterations)
                if new_value < value * (1 - operators().SLIGHT):
                    value, x[:] = new_value, new
                    break
            else:
                return value
        return value

    def _search_as_printed(
        self, x: Array, value: float, iterations: int
    ) -> Generator[Array, None, float]:
        """Eq. 12, with derivatives by central differences."""
        points, new = np.empty((2 * len(x), len(x))), np.empty((1, len(x)))
        gradient = np.empty((1, len(x)))
        damping, accepted = self.settings.damping, True
        for _ in range(iterations):
            if accepted:
                operators().stencil(x, self.lower, self.upper, points)
                yield points
                operators().differences(
                    x, np.array([value]), points, self._totals()[:, None], gradient
                )
            if operators().length(gradient[0]) <= self.settings.gradient_tolerance:
                break
            predicted = operators().printed_step(
                x, gradient[0], damping, self.lower, self.upper, new[0]
            )
            yield new
            new_value = float(self._totals()[0])
            damping = operators().damped(damping, new_value - value, predicted)
            accepted = new_value < value
            if accepted:
                value, x[:] = new_value, new[0]
        return value

    def _search_by_residual(self, x: Array, iterations: int) -> Generator[Array, None, float]:
        """Levenberg-Marquardt on residuals, with derivatives by central differences."""
        n, lower, upper = len(x), self.lower, self.upper
        points, new, gradient = np.empty((2 * n, n)), np.empty((1, n)), np.empty(n)
        normal, matrix, free, step = np.empty((n, n)), np.empty((n, n)), np.empty(n), np.empty(n)
        damping, accepted = self.settings.damping, True
        yield x[None]
        value, residual = float(self._totals()[0]), self._rows()[0].copy()
        if value == np.inf:
            return value  # a point that is not allowed has no slope
        jacobian = np.empty((len(residual), n))
        for _ in range(iterations):
            if accepted:
                operators().stencil(x, lower, upper, points)
                yield points
                operators().differences(x, residual, points, self._rows(), jacobian)
                operators().square(jacobian, residual, normal, gradient)
            size = operators().hold(x, gradient, lower, upper, free)
            if size <= self.settings.gradient_tolerance:
                break
            operators().residual_step(normal, gradient, free, damping, matrix, step)
            predicted = operators().into_box(
                x, normal, gradient, damping, lower, upper, step, new[0]
            )
            yield new
            gain = value - float(self._totals()[0])
            damping = operators().damped(damping, -gain, predicted)
            accepted = gain > 0
            if accepted:
                value, x[:], residual = value - gain, new[0], self._rows()[0].copy()
                if operators().hopeless(value, gain, self._value):
                    break
        return value

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
        """Return the residuals last told, (k, m); the search goes on only when there are some."""
        assert self._told is not None and self._told.ndim == 2  # noqa: S101, PT018  (only a told search goes on)
        return self._told

    def _totals(self) -> Array:
        """Return the values last told, (k,); of residuals, the sums of squares.

        The search goes on only when there are some.
        """
        assert self._told is not None  # noqa: S101  (only a told search goes on)
        return self._told if self._told.ndim == 1 else np.einsum("ij,ij->i", *2 * [self._told])


def _again(
    bounds: ArrayLike,
    start: ArrayLike | None,
    settings: Settings,
    seed: int,
    history: list[Array],
    asked: bool,
    status: str | None,
) -> Optimizer:
    """Return an optimizer that was told ``history``; the way there depends on nothing else."""
    search = Optimizer(bounds, start=start, settings=settings, seed=seed)
    for values in history:
        search.ask()
        search.tell(values)
    if asked:
        search.ask()
    if status is not None:
        search.stop(status)
    return search


def operators() -> ModuleType:
    """Return the compiled operators; loads Numba when first called."""
    from miburi.bma import operators

    return operators


def _checked_bounds(bounds: ArrayLike) -> tuple[Array, Array]:
    try:
        box = real_numbers(bounds)
    except (TypeError, ValueError) as error:
        raise InputError(f"bounds must be pairs of numbers, got {bounds!r}.") from error
    if box.ndim != 2 or box.shape[1] != 2 or not len(box):
        raise InputError(f"bounds must have the shape (n, 2), got {box.shape}.")
    with np.errstate(over="ignore", invalid="ignore"):
        wide = np.isfinite(box[:, 1] - box[:, 0])
    if not np.all(wide) or not np.all(box[:, 0] < box[:, 1]):
        raise InputError(
            "bounds must be finite and their distance too, each least value below its greatest, "
            f"got {bounds!r}."
        )
    return box[:, 0].copy(), box[:, 1].copy()


def _checked_start(start: ArrayLike | None, lower: Array, upper: Array) -> Array:
    if start is None:
        return _middle(lower, upper)
    try:
        point = real_numbers(start)
    except (TypeError, ValueError) as error:
        raise InputError(f"start must be {len(lower)} numbers, got {start!r}.") from error
    if point.shape != lower.shape:
        raise InputError(f"start must have the shape {lower.shape}, got {point.shape}.")
    if not (np.all(point >= lower) and np.all(point <= upper)):
        raise InputError(f"start must lie inside the bounds, got {start!r}.")
    return point


def _middle(lower: Array, upper: Array) -> Array:
    return np.clip(0.5 * lower + 0.5 * upper, lower, upper)
