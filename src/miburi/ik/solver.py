"""Solve for one target or many: check the input, then call the compiled search."""

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
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
    real_numbers,
    seed_of,
)
from miburi.errors import InputError
from miburi.ground.cores import available_cores
from miburi.ik.problem import FARTHEST, RECORD, pack
from miburi.robot import Array, Robot
from miburi.robot.geometry import arm_reach

__all__ = [
    "NEAR",
    "OUT_OF_REACH",
    "REACHED",
    "TOLERANCE",
    "Solution",
    "Solutions",
    "residual_settings",
    "solve",
    "solve_batch",
]

OUT_OF_REACH = "out of reach: this is the best reachable pose"
NEAR = "not reached: this is a reachable pose near the target"

#: A target counts as reached where the residual is not above this share of the arm's reach: of
#: the iphonoid's, 0.07 mm.
REACHED = 5e-4
#: The search ends at this residual, a share of the arm's reach: of the iphonoid's, 0.14 µm.
TOLERANCE = 1e-6


def residual_settings(robot: Robot) -> Settings:
    """Return settings for a search that knows nothing of the body but how to evaluate a pose.

    Table 2 for the population, Levenberg-Marquardt on the residuals, and our own numbers for
    that, in proportion to the arm's reach.
    """
    square = arm_reach(robot) ** 2
    return Settings(
        local_search="residual",
        local_iterations=30,
        first_iterations=30,
        damping=5e-3 * square,
        gradient_tolerance=5e-11 * square,
        ends=4,
        target=TOLERANCE**2 * square,
        local_probability=1.0,
        patience=8,
    )


class Solution(NamedTuple):
    """What :func:`solve` found for one target.

    Attributes
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
        How many generations were begun; always 0 without ``settings``.
    status
        ``CONVERGED``, ``OUT_OF_REACH``, ``NEAR``, ``BUDGET_SPENT`` or ``DEADLINE``.
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
    settings: Settings | None = None,
    seed: Seed = 0,
    deadline: float | None = None,
) -> Solution:
    """Find angles that put the hands and the head on ``target`` (Section 3, Eq. 13).

    Parameters
    ----------
    robot
        Gives lengths and limits.
    target
        (9,) m in the base frame: right x y z, left x y z, head x y z, none beyond ``FARTHEST``.
        Out of reach, the pose with the least residual is found, and ``status`` says so.
    start
        (8,) rad, the present pose: the search begins there, and of several poses with the same
        hands and head the one nearest to it (in the space of angles) is chosen. Angles outside
        the limits count as on them. Without it the search begins where the target points.
    settings
        None for Miburi's own way: a local search, then along the waist, which always finds the
        best pose. Otherwise the memetic algorithm with these settings and no knowledge of the
        body: :func:`residual_settings`, or ``Settings.paper()`` for Table 2 as printed.
    seed
        A whole number from 0, or a NumPy generator: the same seed gives the same solution.
    deadline
        Seconds after which the best so far is returned, above 0.

    Raises
    ------
    InputError
        A shape is wrong, a value is not finite or too large, or an argument does not match its
        description.
    """
    problem, kernel = _problem(robot, settings), _kernel()
    goal = _numbers(target, "target", _NINE)
    pose = _NO_START if start is None else _numbers(start, "start", _EIGHT)
    number = seed_of(seed)
    angles, error = np.empty(8), np.empty(3)
    late = False
    if deadline is None:
        status, residual, evaluations, generations = kernel.solve(
            problem.record, goal, pose, number, angles, error
        )
    else:
        status, residual, evaluations, generations, late = _solve_until(
            problem, goal, pose, number, angles, error, clock_limit(deadline)
        )
    if status == _REFUSED:
        _check_size(goal, "target")
        _check_size(pose, "start")
    words = DEADLINE if late else problem.words(status, residual)
    # Solution(...), in half the time, which is 5 % of a solution's
    return tuple.__new__(Solution, (angles, residual, error, evaluations, generations, words))


def solve_batch(
    robot: Robot,
    targets: ArrayLike,
    *,
    start: ArrayLike | None = None,
    settings: Settings | None = None,
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
    problem, kernel = _problem(robot, settings), _kernel()
    goals = _numbers(targets, "targets", (-1, 9))
    pose = _NO_START if start is None else _numbers(start, "start", _EIGHT)
    _check_size(goals, "targets")
    _check_size(pose, "start")
    number = seed_of(seed)
    angles, errors = np.empty((len(goals), 8)), np.empty((len(goals), 3))
    residual, counts = np.empty(len(goals)), np.empty((len(goals), 3), np.int64)

    def part(rows: slice) -> None:
        kernel.solve_many(
            problem.record,
            goals[rows],
            pose,
            number,
            angles[rows],
            errors[rows],
            residual[rows],
            counts[rows],
        )

    slices = [slice(i, i + _PART) for i in range(0, len(goals), _PART)]
    with ThreadPoolExecutor(available_cores()) as threads:
        list(threads.map(part, slices))
    return Solutions(
        angles,
        residual,
        errors,
        counts[:, 1],
        counts[:, 2],
        tuple(map(problem.words, counts[:, 0].tolist(), residual.tolist())),
    )


_PART = 512  # targets that a thread takes at once
_REFUSED = -1
_WORDS = (BUDGET_SPENT, CONVERGED, NEAR, OUT_OF_REACH)  # by the kernel's GOES_ON ... BEST


@dataclass(frozen=True)
class _Problem:
    """A robot and settings as the compiled code takes them."""

    robot: Robot
    settings: Settings | None
    record: NDArray[np.void]
    reached: float

    def words(self, status: int, residual: float) -> str:
        """Return why a search ended; a pose this near counts as reached, however it was found."""
        return CONVERGED if residual <= self.reached else _WORDS[status]


_last: _Problem | None = None


def _problem(robot: Robot, settings: Settings | None) -> _Problem:
    """Return what the compiled code takes; the answer to the last call is kept."""
    global _last  # noqa: PLW0603  (a pure cache: what it holds never changes an answer)
    known = _last
    if known is not None and known.robot is robot and known.settings is settings:
        return known
    _last = _Problem(
        robot,
        settings,
        pack(robot, settings or _own_settings(robot), by_structure=settings is None),
        REACHED * arm_reach(robot),
    )
    return _last


def _own_settings(robot: Robot) -> Settings:
    """Return the numbers for Miburi's own way: what few iterations miss, the waist search finds."""
    return replace(
        residual_settings(robot), first_iterations=9, damping=5e-4 * arm_reach(robot) ** 2
    )


def _solve_until(
    problem: _Problem,
    goal: Array,
    pose: Array,
    seed: int,
    angles: Array,
    error: Array,
    limit: float,
) -> tuple[int, float, int, int, bool]:
    """Do what the kernel's ``solve`` does, but look at the clock after each generation.

    Returns what it returns, and whether the time was over before the search.
    """
    kernel, record = _kernel(), problem.record[0]
    work = kernel.new_work(goal)[0]
    status, generations = kernel.begin(record, work, pose), 0
    late = time.perf_counter() >= limit
    if status == kernel.GOES_ON:
        population = kernel.new_population(int(record["individuals"]), seed)
    while status == kernel.GOES_ON and generations < record["generations"] and not late:
        status = kernel.evolve(record, work, population, 1)
        generations = int(population.counts[0])
        late = time.perf_counter() >= limit
    residual = kernel.finish(record, work, pose, angles, error)
    late = late and status == kernel.GOES_ON
    return status, residual, int(work["evaluations"]), generations, late


_WIDTHS = {8: "eight angles in rad", 9: "nine coordinates in m"}
_FLOAT, _ARRAY = np.dtype(np.float64), np.ndarray
_NINE, _EIGHT = (9,), (8,)
_NO_START = np.empty(0)


def _numbers(values: ArrayLike, name: str, shape: tuple[int, ...]) -> Array:
    """Return ``values``, or a copy, as contiguous float64 of that shape (-1 for any length)."""
    if type(values) is _ARRAY and values.dtype is _FLOAT and values.shape == shape:
        return values if values.flags.carray else values.copy()
    try:
        array = real_numbers(values)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} must be {_WIDTHS[shape[-1]]}, got {values!r}.") from error
    if array.shape != shape and (len(shape) == 1 or array.shape[1:] != shape[1:]):
        wanted = str(shape).replace("-1", "n")
        raise InputError(
            f"{name} must be {_WIDTHS[shape[-1]]}, of the shape {wanted}; got {array.shape}."
        )
    return array


def _check_size(array: Array, name: str) -> None:
    """Refuse what is not finite, or too large for its square to be."""
    if not np.all(np.abs(array) <= FARTHEST):
        raise InputError(
            f"{name} must be finite numbers, none beyond {FARTHEST:g}, got {array.tolist()}."
        )


@cache
def _kernel() -> Any:
    """Return the compiled code; the first call loads Numba, and compiles all that it may."""
    from miburi.ik import kernel

    rows, pose = np.empty((0, 9)), np.empty(8)
    counts = np.empty((0, 3), np.int64)
    kernel.solve_many(
        np.zeros(1, RECORD), rows, pose, 0, rows[:, :8].copy(), rows[:, :3].copy(),
        np.empty(0), counts,
    )  # fmt: skip
    return kernel
