"""The Bacterial Memetic Algorithm compiled around the kinematics of the body.

In: a problem, as :func:`miburi.ik.problem.pack` packs it, and a work, which holds the target. Out:
the best pose, in the work, and how the search ended. The operators are those of
:mod:`miburi.bma.operators`; here they minimise Eq. 13. Importing this module loads Numba, which
compiles each function at its first call, or loads it from the disk.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from miburi.bma.operators import (
    SLIGHT,
    SWEEPS,
    Array,
    Ints,
    State,
    damped,
    differences,
    ends,
    hold,
    hopeless,
    into_box,
    length,
    most_promising,
    mutate,
    populate,
    printed_step,
    rank,
    shuffle,
    stencil,
    transfer,
    uniform,
)
from miburi.ground.compiled import compiled
from miburi.ik.kinematics import (
    better,
    body_step,
    changed,
    changed_in_turn,
    know,
    linearise,
)
from miburi.ik.limbs import choose_nearest, point_body, search_waist
from miburi.ik.problem import FARTHEST, WORK, Problem, Work

__all__ = [
    "CONVERGED",
    "GOES_ON",
    "SETTLED",
    "Population",
    "begin",
    "evolve",
    "finish",
    "new_population",
    "new_work",
    "solve",
    "solve_many",
]

#: How a search stands; :mod:`miburi.ik.solver` has words for it.
REFUSED, GOES_ON, CONVERGED, SETTLED, BEST = -1, 0, 1, 2, 3

_NEAR = 0.03  # share of γ for a search from the present pose, which is near its end mostly


class Population(NamedTuple):
    """The bacteria, and what a search carries from one generation to the next."""

    poses: Array  # (individuals, 8)
    costs: Array  # (individuals,)
    counts: (
        Ints  # (2,): generations begun (-1: no bacteria yet); local searches since the last gain
    )
    genes: Ints  # (8,): the joints in random order
    state: State  # (1,): the random generator's


@compiled
def _search_by_residual(
    problem: Problem, work: Work, iterations: int, damping: float, q: Array
) -> float:
    """Levenberg-Marquardt on the residuals, in place; return the value reached."""
    lower, upper = problem.lower, problem.upper
    normal, gradient, free, step, new = work.normal, work.gradient, work.free, work.step, work.new
    worth = 0.0 if problem.by_structure else work.value
    value = linearise(problem.size, work, q)
    work.evaluations += 1
    for _ in range(iterations):
        if value <= problem.enough:
            break
        if hold(q, gradient, lower, upper, free) <= problem.gradient_tolerance:
            break
        body_step(work, damping)
        predicted = into_box(q, normal, gradient, damping, lower, upper, step, new)
        new_value = linearise(problem.size, work, new)
        work.evaluations += 1
        gain = value - new_value
        damping = damped(damping, -gain, predicted)
        if gain > 0.0:
            value = new_value
            for j in range(8):
                q[j] = new[j]
            if hopeless(value, gain, worth):
                break
        else:
            linearise(problem.size, work, q)
    better(work, q, value)
    return value


@compiled
def _search_from_ends(problem: Problem, work: Work, iterations: int, q: Array) -> float:
    """Search locally, then from clones with one joint at a limit, as long as that helps."""
    value = _search_by_residual(problem, work, iterations, problem.damping, q)
    if problem.ends == 0 or value <= problem.enough:
        return value
    clones, values, tried = np.empty((16, 8)), np.empty((3, 16)), np.empty(16, np.int64)
    for _ in range(SWEEPS):
        ends(q, problem.lower, problem.upper, clones)
        know(problem.size, work, q)
        changed_in_turn(problem.size, work, clones, values)
        tried[:] = 0
        work.evaluations += 16
        gained = False
        for _ in range(problem.ends):
            i = most_promising(q, problem.lower, problem.upper, values[0], tried)
            if i < 0:
                break
            tried[i] = 1
            new = clones[i]
            new_value = _search_by_residual(problem, work, iterations, problem.damping, new)
            gained = new_value < value * (1.0 - SLIGHT)
            if gained:
                value = new_value
                for j in range(8):
                    q[j] = new[j]
                break
        if not gained or value <= problem.enough:
            break
    return value


@compiled
def _search_as_printed(
    problem: Problem, work: Work, iterations: int, q: Array, value: float
) -> float:
    """Eq. 12 with central differences, in place; return the value reached."""
    points, values, jacobian = np.empty((16, 8)), np.empty((3, 16)), np.empty((1, 8))
    new, gradient, centre = np.empty(8), jacobian[0], np.empty(1)
    damping, accepted = problem.damping, True
    for _ in range(iterations):
        if accepted:
            stencil(q, problem.lower, problem.upper, points)
            know(problem.size, work, q)
            changed_in_turn(problem.size, work, points, values)
            work.evaluations += 16
            centre[0] = value
            differences(q, centre, points, values[:1].T, jacobian)
        if length(gradient) <= problem.gradient_tolerance:
            break
        predicted = printed_step(q, gradient, damping, problem.lower, problem.upper, new)
        new_value = know(problem.size, work, new)
        work.evaluations += 1
        damping = damped(damping, new_value - value, predicted)
        accepted = new_value < value
        if accepted:
            value = new_value
            for j in range(8):
                q[j] = new[j]
    better(work, q, value)
    return value


@compiled
def _populate(problem: Problem, work: Work, population: Population) -> None:
    poses, costs = population.poses, population.costs
    populate(poses, problem.lower, problem.upper, population.state)
    if work.value < np.inf:
        poses[-1] = work.best
    for i in range(costs.size):
        costs[i] = know(problem.size, work, poses[i])
        better(work, poses[i], costs[i])
    work.evaluations += costs.size


@compiled
def _search_locally(problem: Problem, work: Work, iterations: int, q: Array, value: float) -> float:
    if problem.by_residual:
        return _search_from_ends(problem, work, iterations, q)
    return _search_as_printed(problem, work, iterations, q, value)


@compiled
def _mutate_all(problem: Problem, work: Work, population: Population) -> None:
    """Bacterial mutation of every bacterium, segment by segment in random order."""
    costs, genes, state = population.costs, population.genes, population.state
    clones, tried = np.empty((problem.clones - 1, 8)), np.empty((3, problem.clones - 1))
    for i in range(costs.size):
        bacterium = population.poses[i]
        know(problem.size, work, bacterium)
        shuffle(genes, state)
        for first in range(0, 8, problem.segment):
            segment = genes[first : first + problem.segment]
            mutate(bacterium, segment, problem.lower, problem.upper, state, clones)
            if segment.size == 1:
                changed(problem.size, work, clones, segment[0], tried)
            else:
                for k in range(clones.shape[0]):
                    tried[0, k] = know(problem.size, work, clones[k])
            chosen = -1
            for k in range(clones.shape[0]):
                if tried[0, k] < costs[i]:
                    costs[i], chosen = tried[0, k], k
            work.evaluations += clones.shape[0]
            if chosen >= 0:
                for j in range(8):
                    bacterium[j] = clones[chosen, j]
                know(problem.size, work, bacterium)
        better(work, bacterium, costs[i])


@compiled
def _transfer_genes(problem: Problem, work: Work, population: Population) -> None:
    poses, costs = population.poses, population.costs
    rank(poses, costs)
    for _ in range(problem.transfers):
        taker = transfer(poses, problem.transferred, population.genes, population.state)
        costs[taker] = know(problem.size, work, poses[taker])
        work.evaluations += 1
        better(work, poses[taker], costs[taker])
        rank(poses, costs)


@compiled
def _generation(problem: Problem, work: Work, population: Population) -> int:
    """Apply the three operators; return how the search stands, as soon as it is over."""
    poses, costs, counts = population.poses, population.costs, population.counts
    if not problem.local_first:
        _mutate_all(problem, work, population)
    for i in range(costs.size):
        if work.value <= problem.enough:
            return CONVERGED
        if uniform(population.state) < problem.local_probability:
            before = work.value
            costs[i] = _search_locally(problem, work, problem.local_iterations, poses[i], costs[i])
            counts[1] = 0 if work.value < before * (1.0 - SLIGHT) else counts[1] + 1
            if work.value > problem.enough and 0 < problem.patience <= counts[1]:
                return SETTLED
    if problem.local_first and work.value > problem.enough:
        _mutate_all(problem, work, population)
    if work.value > problem.enough:
        _transfer_genes(problem, work, population)
    return CONVERGED if work.value <= problem.enough else GOES_ON


@compiled
def begin(problem: Problem, work: Work, start: Array) -> int:
    """Search locally from ``start``, (8,), and from the middle of the limits; (0,) for no start.

    Returns how the search stands.
    """
    lower, upper, pose = problem.lower, problem.upper, np.empty(8)
    has_start = start.size > 0
    for j in range(8):
        middle = 0.5 * (lower[j] + upper[j])
        pose[j] = min(max(start[j], lower[j]), upper[j]) if has_start else middle
        work.best[j] = pose[j]
    if problem.by_structure:
        return _begin_by_structure(problem, work, has_start, pose)
    if has_start or (problem.first_iterations > 0 and not problem.by_residual):
        work.value = know(problem.size, work, pose)
        work.evaluations += 1
    if problem.first_iterations > 0:
        _search_locally(problem, work, problem.first_iterations, pose, work.value)
        if has_start and work.value > problem.enough:
            for j in range(8):
                pose[j] = 0.5 * (lower[j] + upper[j])
            value = know(problem.size, work, pose)
            _search_locally(problem, work, problem.first_iterations, pose, value)
    return CONVERGED if work.value <= problem.enough else GOES_ON


@compiled
def _begin_by_structure(problem: Problem, work: Work, has_start: bool, pose: Array) -> int:
    """Search locally from the start, then from where the target points; then along the waist."""
    iterations = problem.first_iterations
    if has_start:
        _search_by_residual(problem, work, iterations, _NEAR * problem.damping, pose)
    if work.value > problem.enough:
        point_body(problem, work, pose)
        _search_by_residual(problem, work, iterations, problem.damping, pose)
    if work.value <= problem.enough:
        return CONVERGED
    search_waist(problem, work)
    return CONVERGED if work.value <= problem.enough else BEST


@compiled
def evolve(problem: Problem, work: Work, population: Population, generations: int) -> int:
    """Run ``generations`` more, or fewer if the search ends; return how it stands."""
    counts = population.counts
    if counts[0] < 0:
        counts[0] = counts[1] = 0
        _populate(problem, work, population)
    for _ in range(generations):
        counts[0] += 1
        status = _generation(problem, work, population)
        if status != GOES_ON:
            return status
    return GOES_ON


@compiled
def new_population(individuals: int, seed: int) -> Population:
    """Return memory for the bacteria; :func:`evolve` draws them."""
    return Population(
        np.empty((individuals, 8)),
        np.empty(individuals),
        np.full(2, -1),
        np.arange(8),
        np.full(1, np.uint64(seed)),
    )


@compiled
def new_work(target: Array) -> NDArray[np.void]:
    """Return memory for a search, a row of ``WORK``."""
    memory = np.zeros(1, WORK)
    work: Work = memory[0]
    for j in range(9):
        work.target[j] = target[j]
    work.value = np.inf
    return memory


@compiled
def finish(problem: Problem, work: Work, start: Array, angles: Array, error: Array) -> float:
    """Of the poses that do the same, choose the one nearest to ``start``, if there is one.

    Writes the angles, (8,), and the error of each extremity, (3,); returns the residual, in m.
    """
    for j in range(8):
        angles[j] = work.best[j]
    if start.size > 0:
        choose_nearest(problem, work, start, angles)
    total = know(problem.size, work, angles)
    for limb in range(3):
        error[limb] = sqrt(work.errors[limb])
    return sqrt(total)


@compiled
def solve(
    record: NDArray[np.void],
    target: Array,
    start: Array,
    seed: int,
    angles: Array,
    error: Array,
) -> tuple[int, float, int, int]:
    """Search to the end; write the angles, (8,), and the error of each extremity, (3,).

    ``start`` is (8,), or (0,) for none: an argument less takes 0.1 µs less.

    Returns how the search ended, the residual, the evaluations and the generations.
    """
    if not (_bounded(target) and _bounded(start)):
        return REFUSED, np.nan, 0, 0
    return _solve(record, new_work(target), start, seed, angles, error)


@compiled
def _solve(
    record: NDArray[np.void],
    memory: NDArray[np.void],
    start: Array,
    seed: int,
    angles: Array,
    error: Array,
) -> tuple[int, float, int, int]:
    """Do so with memory that the caller holds: a record alone does not keep its array alive."""
    problem: Problem = record[0]
    work: Work = memory[0]
    status, generations = begin(problem, work, start), 0
    if status == GOES_ON:
        population = new_population(problem.individuals, seed)
        status = evolve(problem, work, population, problem.generations)
        generations = population.counts[0]
    residual = finish(problem, work, start, angles, error)
    return status, residual, work.evaluations, generations


@compiled
def _bounded(values: Array) -> bool:
    """Whether all are numbers, none beyond ``FARTHEST``."""
    bounded = True
    for j in range(values.size):
        bounded &= abs(values[j]) <= FARTHEST
    return bounded


@compiled
def solve_many(
    record: NDArray[np.void],
    targets: Array,
    start: Array,
    seed: int,
    angles: Array,
    errors: Array,
    residuals: Array,
    counts: Ints,
) -> None:
    """Call :func:`solve` for every row, (n, 9).

    Writes ``angles``, (n, 8), ``errors``, (n, 3), ``residuals``, (n,), and ``counts``, (n, 3): how
    each search ended, its evaluations and its generations.
    """
    for i in range(targets.shape[0]):
        status, residual, evaluations, generations = solve(
            record, targets[i], start, seed, angles[i], errors[i]
        )
        residuals[i] = residual
        counts[i, 0] = status
        counts[i, 1] = evaluations
        counts[i, 2] = generations
