"""Solve for one target or many: check the input, then search over the waist or by evolution."""

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from miburi.bma.search import Optimizer
from miburi.bma.settings import (
    CONVERGED,
    DEADLINE,
    SETTLED,
    Settings,
    checked_settings,
)
from miburi.errors import InputError
from miburi.ground.arguments import Seed, clock_limit, real_numbers, seed_of
from miburi.ground.cores import available_cores
from miburi.ik.problem import BODY, FARTHEST, TOLERANCE, pack
from miburi.robot import Array, Robot
from miburi.robot.geometry import arm_reach

OUT_OF_REACH = "out of reach: this is the best reachable pose"
NEAR = "the target was not reached; this pose is near it"


def residual_settings(robot: Robot) -> Settings:
    """Return settings for a search that knows nothing of the body but how to evaluate a pose.

    The population is that of the paper's Table 2. The local search is Levenberg-Marquardt on the
    residuals, with our numbers, in proportion to the arm's reach.
    """
    square = arm_reach(robot) ** 2
    return Settings(
        local_search="residual",
        local_iterations=30,
        first_iterations=30,
        damping=5e-3 * square,
        gradient_tolerance=5e-11 * square,
        relative=False,
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
        The norm of the nine coordinate errors, in m: the square root of Eq. 13.
    error
        (3,) m, how far the right hand, the left hand and the head are from their targets.
    evaluations, generations
        How many poses were tried, and how many generations were begun (0 without ``settings``).
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
    """What :func:`solve_batch` found: the fields of :class:`Solution`, one row for each target.

    Attributes
    ----------
    angles, error, residual, evaluations, generations, status
        ``angles`` has shape (n, 8), in rad; ``error`` has shape (n, 3), in m; ``residual`` has
        shape (n,), in m. ``evaluations`` and ``generations`` have shape (n,), and ``status`` has
        n words.
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
        return Solution(*(getattr(self, name)[i] for name in Solution._fields))


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
        Nine coordinates in m in the base frame: x, y and z of the right hand, the left hand and
        the head, none beyond ``FARTHEST``. If the target is out of reach, the pose with the least
        residual is found, and ``status`` says so.
    start
        The present pose, eight angles in rad; angles outside the limits are clamped to the limits.
        Of several poses that reach the same points, the one nearest to ``start`` (in the space of
        angles) is chosen. A search by ``settings`` begins at ``start``.
    settings
        None uses Miburi's search over the waist, which always finds the best pose. With
        settings, the memetic algorithm searches without any knowledge of the body. Use
        :func:`residual_settings`, or ``Settings.paper()`` for Table 2 as printed.
    seed
        A whole number, 0 or more, or a NumPy generator, for a search by ``settings``: the same seed
        gives the same solution.
    deadline
        The time in seconds, above 0, after which a search by ``settings`` returns its best pose so
        far. Miburi's own search takes less than a millisecond and does not look at the clock.

    Raises
    ------
    InputError
        An argument has the wrong shape or is not allowed, or a value is not finite or too large.
    """
    record = _record(robot)
    goal = _numbers(target, "target", _NINE)
    pose = _NO_START if start is None else _numbers(start, "start", _EIGHT)
    if settings is not None or deadline is not None:
        limit = clock_limit(deadline)
        if settings is not None:
            return _evolve(robot, goal, pose, checked_settings(settings), seed_of(seed), limit)
    angles, error = np.empty(8), np.empty(3)
    status, residual, evaluations = _kernel().solve(record, goal, pose, angles, error)
    if status < 0:  # it was refused
        _check_size(goal, "target")
        _check_size(pose, "start")
    # the same as Solution(...) in half the time, which saves 5 % of a solution's time
    return tuple.__new__(Solution, (angles, residual, error, evaluations, 0, _WORDS[status]))


def solve_batch(
    robot: Robot,
    targets: ArrayLike,
    *,
    start: ArrayLike | None = None,
) -> Solutions:
    """Solve many targets on all cores, each as :func:`solve` alone would.

    Parameters
    ----------
    robot, start
        As in :func:`solve`; they hold for every target.
    targets
        (n, 9) m; n may be 0.

    Raises
    ------
    InputError
        As in :func:`solve`.
    """
    record, kernel = _record(robot), _kernel()
    goals = _numbers(targets if np.size(targets) else np.empty((0, 9)), "targets", (-1, 9))
    pose = _NO_START if start is None else _numbers(start, "start", _EIGHT)
    _check_size(goals, "targets")
    _check_size(pose, "start")
    angles, errors = np.empty((len(goals), 8)), np.empty((len(goals), 3))
    residual, counts = np.empty(len(goals)), np.empty((len(goals), 2), np.int64)

    def part(rows: slice) -> None:
        kernel.solve_many(
            record, goals[rows], pose, angles[rows], errors[rows], residual[rows], counts[rows]
        )

    with ThreadPoolExecutor(available_cores()) as threads:
        list(threads.map(part, [slice(i, i + _PART) for i in range(0, len(goals), _PART)]))
    statuses = tuple(_WORDS[status] for status in counts[:, 0].tolist())
    none = np.zeros(len(goals), np.int64)
    return Solutions(angles, residual, errors, counts[:, 1], none, statuses)


_PART = 512  # targets that a thread takes in one piece
_WORDS = (CONVERGED, OUT_OF_REACH)  # indexed by the kernel's REACHED and BEST


def _evolve(
    robot: Robot, goal: Array, pose: Array, settings: Settings, seed: int, limit: float
) -> Solution:
    """Search by the memetic algorithm, which only evaluates poses of the body."""
    from miburi.ik.residuals import jacobian, residuals

    _check_size(goal, "target")
    _check_size(pose, "start")
    record = _record(robot)
    box = np.column_stack([robot.lower, robot.upper])
    begin = np.clip(pose, robot.lower, robot.upper) if pose.size else None
    slopes = partial(jacobian, record) if settings.local_search == "residual" else None
    search = Optimizer(box, start=begin, settings=settings, seed=seed, jacobian=slopes)
    while search.follow(partial(residuals, record, goal)):
        if time.perf_counter() >= limit:
            search.stop(DEADLINE)
    x, _, evaluations, generations, status = vars(search.result).values()
    errors = residuals(record, goal, x[None]).reshape(3, 3)
    residual, error = float(np.linalg.norm(errors)), np.linalg.norm(errors, axis=1)
    if residual <= record[0]["reached"]:
        status = CONVERGED
    elif status in (CONVERGED, SETTLED):
        status = NEAR
    return Solution(x, residual, error, evaluations, generations, status)


_known: dict[int, tuple[Robot, NDArray[np.void]]] = {}


def _record(robot: Robot) -> NDArray[np.void]:
    """Return the packed record of a body; the records of the last few robots are cached."""
    known = _known.get(id(robot))
    if known is not None and known[0] is robot:
        return known[1]
    if not isinstance(robot, Robot):
        raise InputError(f"robot must be a Robot, such as iphonoid(), got {robot!r}.")
    if len(_known) >= 64:
        _known.clear()
    _known[id(robot)] = robot, pack(robot)
    return _known[id(robot)][1]


_WIDTHS = {8: "eight angles in rad", 9: "nine coordinates in m"}
_FLOAT, _ARRAY = np.dtype(np.float64), np.ndarray
_NINE, _EIGHT, _NO_START = (9,), (8,), np.empty(0)


def _numbers(values: ArrayLike, name: str, shape: tuple[int, ...]) -> Array:
    """Return ``values``, or a copy, as contiguous float64 of that shape (-1 for any length)."""
    if type(values) is _ARRAY and values.dtype is _FLOAT and values.shape == shape:
        return values if values.flags.carray else values.copy()
    array = real_numbers(values, name, _WIDTHS[shape[-1]])
    if array.shape != shape and (len(shape) == 1 or array.shape[1:] != shape[1:]):
        wanted = f"{_WIDTHS[shape[-1]]}, of the shape {str(shape).replace('-1', 'n')}"
        raise InputError(f"{name} must be {wanted}; got {array.shape}.")
    return array


def _check_size(array: Array, name: str) -> None:
    if not np.all(np.abs(array) <= FARTHEST):
        raise InputError(
            f"{name} must be finite numbers, none beyond {FARTHEST:g}, got {array.tolist()}."
        )


@cache
def _kernel() -> Any:
    """Return the compiled code; the first call loads Numba, and compiles what solving needs."""
    from miburi.ik import kernel

    nine, eight, three, two = (np.empty((0, width)) for width in (9, 8, 3, 2))
    counts = two.astype(np.int64)
    kernel.solve_many(np.zeros(1, BODY), nine, np.empty(8), eight, three, np.empty(0), counts)
    return kernel
