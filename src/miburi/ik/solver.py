"""Solve for one target or many: check the input, then call the compiled search."""

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from math import isfinite
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from miburi.bma.settings import (
    BUDGET_SPENT,
    CONVERGED,
    DEADLINE,
    Seed,
    Settings,
    clock_limit,
    seed_of,
)
from miburi.errors import InputError
from miburi.ground.cores import available_cores
from miburi.ik.problem import pack
from miburi.robot import Array, Robot

__all__ = [
    "OUT_OF_REACH",
    "REACHED",
    "SETTINGS",
    "TOLERANCE",
    "Solution",
    "Solutions",
    "solve",
    "solve_batch",
]

OUT_OF_REACH = "out of reach: this is the best reachable pose"

#: A target counts as reached where the residual is not above this, in m.
REACHED = 1e-4
#: The search ends at this residual, in m.
TOLERANCE = 1e-6

#: The settings of :func:`solve` if none are given: Table 2 for the population, and our own
#: numbers for the local search.
SETTINGS = Settings(
    local_search="residual",
    local_iterations=30,
    first_iterations=30,
    damping=1e-4,
    gradient_tolerance=1e-9,
    ends=4,
    target=TOLERANCE**2,
    local_probability=1.0,
    patience=8,
)


class Solution(NamedTuple):
    """What :func:`solve` found for one target.

    Parameters
    ----------
    angles
        (8,) rad inside the limits, in the order of ``JOINTS``.
    residual
        The length of the nine coordinate errors, in m: the square root of Eq. 13.
    error
        (3,) m, how far the right hand, the left hand and the head are from their targets.
    evaluations
        How many poses were tried.
    generations
        How many generations were begun; 0 where the first local search was enough.
    status
        ``CONVERGED``, ``OUT_OF_REACH``, ``BUDGET_SPENT`` or ``DEADLINE``.
    """

    angles: Array
    residual: float
    error: Array
    evaluations: int
    generations: int
    status: str


@dataclass(frozen=True)
class Solutions:
    """What :func:`solve_batch` found for n targets: the fields of :class:`Solution`, n of each.

    ``solutions[i]`` is the i-th :class:`Solution`.
    """

    angles: Array
    residual: Array
    error: Array
    evaluations: NDArray[np.int64]
    generations: NDArray[np.int64]
    status: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.status)

    def __getitem__(self, i: int) -> Solution:
        return Solution(
            self.angles[i],
            float(self.residual[i]),
            self.error[i],
            int(self.evaluations[i]),
            int(self.generations[i]),
            self.status[i],
        )


def solve(
    robot: Robot,
    target: ArrayLike,
    *,
    start: ArrayLike | None = None,
    settings: Settings = SETTINGS,
    seed: Seed = 0,
    deadline: float | None = None,
) -> Solution:
    """Find angles that put the hands and the head on ``target`` (Section 3, Eq. 13).

    Parameters
    ----------
    robot
        Gives lengths and limits.
    target
        (9,) m in the base frame: right x y z, left x y z, head x y z. Out of reach, the pose
        with the least residual is found, and ``status`` says so.
    start
        (8,) rad, the present pose: the search begins there, and of several poses with the same
        hands and head the one nearest to it (in the space of angles) is chosen. Angles outside
        the limits count as on them. Without it the search begins at the middle of the limits.
    settings
        How to search; ``Settings.paper()`` for Table 2 as printed.
    seed
        A whole number from 0, or a NumPy generator: the same seed gives the same solution.
    deadline
        Seconds after which the best so far is returned, above 0.

    Raises
    ------
    InputError
        A shape is wrong, a value is not finite, or an argument does not match its description.
    """
    problem = _problem(robot, settings)
    goal = _numbers(target, "target", (9,))
    pose = problem.middle if start is None else problem.inside(_numbers(start, "start", (8,)))
    result = np.empty(11)
    if deadline is None:
        status, residual, evaluations, generations = _kernel().solve(
            problem.record, goal, pose, start is not None, seed_of(seed), result
        )
        words = _words(status, residual)
    else:
        limit = clock_limit(deadline)
        words, residual, evaluations, generations = _solve_until(
            problem, goal, pose, start is not None, seed_of(seed), result, limit
        )
    return Solution(result[:8], residual, result[8:], evaluations, generations, words)


def solve_batch(
    robot: Robot,
    targets: ArrayLike,
    *,
    start: ArrayLike | None = None,
    settings: Settings = SETTINGS,
    seed: Seed = 0,
) -> Solutions:
    """Solve many targets on all cores, each as :func:`solve` alone would.

    Parameters
    ----------
    robot, start, settings, seed
        As in :func:`solve`; they hold for every target.
    targets
        (n, 9) m, n from 0.

    Raises
    ------
    InputError
        As in :func:`solve`.
    """
    problem = _problem(robot, settings)
    goals = _numbers(targets, "targets", (-1, 9))
    pose = problem.middle if start is None else problem.inside(_numbers(start, "start", (8,)))
    number, kernel = seed_of(seed), _kernel()
    results, residual = np.empty((len(goals), 11)), np.empty(len(goals))
    counts = np.empty((len(goals), 3), np.int64)

    def part(rows: slice) -> None:
        kernel.solve_many(
            problem.record,
            goals[rows],
            pose,
            start is not None,
            number,
            results[rows],
            residual[rows],
            counts[rows],
        )

    slices = [slice(i, i + _PART) for i in range(0, len(goals), _PART)]
    with ThreadPoolExecutor(available_cores()) as threads:
        list(threads.map(part, slices))
    return Solutions(
        results[:, :8],
        residual,
        results[:, 8:],
        counts[:, 1],
        counts[:, 2],
        tuple(map(_words, counts[:, 0].tolist(), residual.tolist())),
    )


_PART = 512  # targets that a thread takes at once
_WORDS = (BUDGET_SPENT, CONVERGED, OUT_OF_REACH)  # by the kernel's GOES_ON, CONVERGED, SETTLED


def _words(status: int, residual: float) -> str:
    """Return why a search ended; a pose this near counts as reached, however it was found."""
    return CONVERGED if residual <= REACHED else _WORDS[status]


@dataclass(frozen=True)
class _Problem:
    """A robot and settings as the compiled code takes them."""

    robot: Robot
    settings: Settings
    record: NDArray[np.void]
    middle: Array

    def inside(self, pose: Array) -> Array:
        return np.clip(pose, self.robot.lower, self.robot.upper)


_last: _Problem | None = None


def _problem(robot: Robot, settings: Settings) -> _Problem:
    """Return what the compiled code takes; the answer to the last call is kept."""
    global _last  # noqa: PLW0603  (a pure cache: what it holds never changes an answer)
    known = _last
    if known is not None and known.robot is robot and known.settings is settings:
        return known
    _last = _Problem(robot, settings, pack(robot, settings), (robot.lower + robot.upper) / 2)
    return _last


def _solve_until(
    problem: _Problem,
    goal: Array,
    pose: Array,
    has_start: bool,
    seed: int,
    result: Array,
    limit: float,
) -> tuple[str, float, int, int]:
    """Do what the kernel's ``solve`` does, but look at the clock after each generation."""
    kernel, record = _kernel(), problem.record[0]
    best = kernel.Best(pose.copy(), np.empty(1), np.zeros(1, np.int64))
    status, generations = kernel.begin(record, goal, has_start, best), 0
    late = time.perf_counter() >= limit
    if status == kernel.GOES_ON:
        population = kernel.new_population(problem.settings.individuals, seed)
    while status == kernel.GOES_ON and generations < problem.settings.generations and not late:
        status = kernel.evolve(record, goal, population, best, 1)
        generations = int(population.counts[0])
        late = time.perf_counter() >= limit
    residual = kernel.finish(record, goal, pose, has_start, best.pose, result)
    words = DEADLINE if status == kernel.GOES_ON and late else _words(status, residual)
    return words, residual, int(best.evaluations[0]), generations


_WIDTHS = {8: "eight angles in rad", 9: "nine coordinates in m"}


def _numbers(values: ArrayLike, name: str, shape: tuple[int, ...]) -> Array:
    """Return ``values`` as finite float64, contiguous, of that shape (-1 for any length)."""
    try:
        array = np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} must be {_WIDTHS[shape[-1]]}, got {values!r}.") from error
    if array.shape != shape and (len(shape) == 1 or array.shape[1:] != shape[1:]):
        wanted = str(shape).replace("-1", "n")
        raise InputError(
            f"{name} must be {_WIDTHS[shape[-1]]}, of the shape {wanted}; got {array.shape}."
        )
    flat = array.ravel()  # one product is the quickest test, but finite values may overflow it
    if not isfinite(flat.dot(flat)) and not np.isfinite(array).all():
        raise InputError(f"{name} must be finite numbers, got {values!r}.")
    return array


@cache
def _kernel() -> Any:
    """Return the compiled code; the first call loads Numba."""
    from miburi.ik import kernel

    return kernel
