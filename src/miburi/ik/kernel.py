"""The Bacterial Memetic Algorithm compiled around the kinematics of the body.

In: a problem, as :func:`miburi.ik.problem.pack` packs it, and a target. Out: the best pose, and
how the search ended. The operators are those of :mod:`miburi.bma.operators`; here they minimise
Eq. 13. Importing this module loads Numba, which compiles each function at its first call, or
loads it from the disk.
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
    Best,
    Pose,
    better,
    body_step,
    changed,
    changed_in_turn,
    know,
    known_pose,
    linearise,
)
from miburi.ik.limbs import choose_nearest, point_body, search_waist
from miburi.ik.problem import FARTHEST, Problem

__all__ = [
    "CONVERGED",
    "GOES_ON",
    "SETTLED",
    "Best",
    "Population",
    "begin",
    "evolve",
    "finish",
    "new_best",
    "new_population",
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
    problem: Problem, target: Array, iterations: int, damping: float, q: Array, best: Best
) -> float:
    """Levenberg-Marquardt on the residuals, in place; return the value reached."""
    memory = np.zeros((14, 8))
    normal, gradient, free, step, new = memory[:8], memory[8], memory[9], memory[10], memory[11]
    pose = Pose(memory[12], memory[13], free[:3])
    worth = 0.0 if problem.by_structure else best.value[0]
    value = linearise(problem.size, target, q, pose, normal, gradient)
    best.evaluations[0] += 1
    for _ in range(iterations):
        if value <= problem.enough:
            break
        if hold(q, gradient, problem.lower, problem.upper, free) <= problem.gradient_tolerance:
            break
        body_step(normal, gradient, free, damping, step)
        predicted = into_box(q, normal, gradient, damping, problem.lower, problem.upper, step, new)
        new_value = linearise(problem.size, target, new, pose, normal, gradient)
        best.evaluations[0] += 1
        gain = value - new_value
        damping = damped(damping, -gain, predicted)
        if gain > 0.0:
            value = new_value
            for j in range(8):
                q[j] = new[j]
            if hopeless(value, gain, worth):
                break
        else:
            linearise(problem.size, target, q, pose, normal, gradient)
    better(best, q, value)
    return value


@compiled
def _search_from_ends(
    problem: Problem, target: Array, iterations: int, q: Array, best: Best
) -> float:
    """Search locally, then from clones with one joint at a limit, as long as that helps."""
    value = _search_by_residual(problem, target, iterations, problem.damping, q, best)
    if problem.ends == 0 or value <= problem.enough:
        return value
    clones, values, tried = np.empty((16, 8)), np.empty((3, 16)), np.empty(16, np.int64)
    pose = known_pose()
    for _ in range(SWEEPS):
        ends(q, problem.lower, problem.upper, clones)
        know(problem.size, target, q, pose)
        changed_in_turn(problem.size, target, clones, pose, values)
        tried[:] = 0
        best.evaluations[0] += 16
        gained = False
        for _ in range(problem.ends):
            i = most_promising(q, problem.lower, problem.upper, values[0], tried)
            if i < 0:
                break
            tried[i] = 1
            new = clones[i]
            new_value = _search_by_residual(problem, target, iterations, problem.damping, new, best)
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
    problem: Problem,
    target: Array,
    iterations: int,
    q: Array,
    value: float,
    best: Best,
) -> float:
    """Eq. 12 with central differences, in place; return the value reached."""
    points, values, jacobian = np.empty((16, 8)), np.empty((3, 16)), np.empty((1, 8))
    pose, new, gradient, centre = known_pose(), np.empty(8), jacobian[0], np.empty(1)
    damping, accepted = problem.damping, True
    for _ in range(iterations):
        if accepted:
            stencil(q, problem.lower, problem.upper, points)
            know(problem.size, target, q, pose)
            changed_in_turn(problem.size, target, points, pose, values)
            best.evaluations[0] += 16
            centre[0] = value
            differences(q, centre, points, values[:1].T, jacobian)
        if length(gradient) <= problem.gradient_tolerance:
            break
        predicted = printed_step(q, gradient, damping, problem.lower, problem.upper, new)
        new_value = know(problem.size, target, new, pose)
        best.evaluations[0] += 1
        damping = damped(damping, new_value - value, predicted)
        accepted = new_value < value
        if accepted:
            value = new_value
            for j in range(8):
                q[j] = new[j]
    better(best, q, value)
    return value


@compiled
def _populate(problem: Problem, target: Array, population: Population, best: Best) -> None:
    poses, costs, pose = population.poses, population.costs, known_pose()
    populate(poses, problem.lower, problem.upper, population.state)
    if best.value[0] < np.inf:
        poses[-1] = best.pose
    for i in range(costs.size):
        costs[i] = know(problem.size, target, poses[i], pose)
        better(best, poses[i], costs[i])
    best.evaluations[0] += costs.size


@compiled
def _search_locally(
    problem: Problem,
    target: Array,
    iterations: int,
    q: Array,
    value: float,
    best: Best,
) -> float:
    if problem.by_residual:
        return _search_from_ends(problem, target, iterations, q, best)
    return _search_as_printed(problem, target, iterations, q, value, best)


@compiled
def _mutate_all(problem: Problem, target: Array, population: Population, best: Best) -> None:
    """Bacterial mutation of every bacterium, segment by segment in random order."""
    costs, genes, state = population.costs, population.genes, population.state
    clones, tried = np.empty((problem.clones - 1, 8)), np.empty((3, problem.clones - 1))
    pose = known_pose()
    for i in range(costs.size):
        bacterium = population.poses[i]
        know(problem.size, target, bacterium, pose)
        shuffle(genes, state)
        for first in range(0, 8, problem.segment):
            segment = genes[first : first + problem.segment]
            mutate(bacterium, segment, problem.lower, problem.upper, state, clones)
            if segment.size == 1:
                changed(problem.size, target, clones, segment[0], pose, tried)
            else:
                for k in range(clones.shape[0]):
                    tried[0, k] = know(problem.size, target, clones[k], pose)
            chosen = -1
            for k in range(clones.shape[0]):
                if tried[0, k] < costs[i]:
                    costs[i], chosen = tried[0, k], k
            best.evaluations[0] += clones.shape[0]
            if chosen >= 0:
                for j in range(8):
                    bacterium[j] = clones[chosen, j]
                know(problem.size, target, bacterium, pose)
        better(best, bacterium, costs[i])


@compiled
def _transfer_genes(problem: Problem, target: Array, population: Population, best: Best) -> None:
    poses, costs, pose = population.poses, population.costs, known_pose()
    rank(poses, costs)
    for _ in range(problem.transfers):
        taker = transfer(poses, problem.transferred, population.genes, population.state)
        costs[taker] = know(problem.size, target, poses[taker], pose)
        best.evaluations[0] += 1
        better(best, poses[taker], costs[taker])
        rank(poses, costs)


@compiled
def _generation(problem: Problem, target: Array, population: Population, best: Best) -> int:
    """Apply the three operators; return how the search stands, as soon as it is over."""
    poses, costs, counts = population.poses, population.costs, population.counts
    if not problem.local_first:
        _mutate_all(problem, target, population, best)
    for i in range(costs.size):
        if best.value[0] <= problem.enough:
            return CONVERGED
        if uniform(population.state) < problem.local_probability:
            before = best.value[0]
            costs[i] = _search_locally(
                problem, target, problem.local_iterations, poses[i], costs[i], best
            )
            counts[1] = 0 if best.value[0] < before * (1.0 - SLIGHT) else counts[1] + 1
            if best.value[0] > problem.enough and 0 < problem.patience <= counts[1]:
                return SETTLED
    if problem.local_first and best.value[0] > problem.enough:
        _mutate_all(problem, target, population, best)
    if best.value[0] > problem.enough:
        _transfer_genes(problem, target, population, best)
    return CONVERGED if best.value[0] <= problem.enough else GOES_ON


@compiled
def begin(problem: Problem, target: Array, has_start: bool, best: Best) -> int:
    """Search locally from the pose in ``best``, and if that was given, from the middle too.

    Returns how the search stands.
    """
    for j in range(8):
        best.pose[j] = min(max(best.pose[j], problem.lower[j]), problem.upper[j])
    if problem.by_structure:
        return _begin_by_structure(problem, target, has_start, best)
    if has_start or (problem.first_iterations > 0 and not problem.by_residual):
        best.value[0] = know(problem.size, target, best.pose, known_pose())
        best.evaluations[0] += 1
    if problem.first_iterations > 0:
        pose, value = best.pose.copy(), best.value[0]
        _search_locally(problem, target, problem.first_iterations, pose, value, best)
        if has_start and best.value[0] > problem.enough:
            pose = 0.5 * (problem.lower + problem.upper)
            value = know(problem.size, target, pose, known_pose())
            _search_locally(problem, target, problem.first_iterations, pose, value, best)
    return CONVERGED if best.value[0] <= problem.enough else GOES_ON


@compiled
def _begin_by_structure(problem: Problem, target: Array, has_start: bool, best: Best) -> int:
    """Search locally from the start, then from where the target points; then along the waist."""
    pose, iterations = best.pose.copy(), problem.first_iterations
    if has_start:
        _search_by_residual(problem, target, iterations, _NEAR * problem.damping, pose, best)
    if best.value[0] > problem.enough:
        point_body(problem, target, pose)
        _search_by_residual(problem, target, iterations, problem.damping, pose, best)
    if best.value[0] <= problem.enough:
        return CONVERGED
    search_waist(problem, target, best)
    return CONVERGED if best.value[0] <= problem.enough else BEST


@compiled
def evolve(
    problem: Problem, target: Array, population: Population, best: Best, generations: int
) -> int:
    """Run ``generations`` more, or fewer if the search ends; return how it stands."""
    counts = population.counts
    if counts[0] < 0:
        counts[0] = counts[1] = 0
        _populate(problem, target, population, best)
    for _ in range(generations):
        counts[0] += 1
        status = _generation(problem, target, population, best)
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
def new_best(start: Array) -> Best:
    """Return memory for the best pose: ``start``, not evaluated yet."""
    return Best(start.copy(), np.full(1, np.inf), np.zeros(1, np.int64))


@compiled
def finish(
    problem: Problem,
    target: Array,
    start: Array,
    has_start: bool,
    pose: Array,
    angles: Array,
    error: Array,
) -> float:
    """Of the poses that do the same, choose the one nearest to ``start``, if there is one.

    Writes the angles, (8,), and the error of each extremity, (3,); returns the residual, in m.
    """
    if has_start:
        choose_nearest(problem, target, start, pose)
    known = known_pose()
    total = know(problem.size, target, pose, known)
    for j in range(8):
        angles[j] = pose[j]
    for limb in range(3):
        error[limb] = sqrt(known.errors[limb])
    return sqrt(total)


@compiled
def solve(
    record: NDArray[np.void],
    target: Array,
    start: Array,
    has_start: bool,
    seed: int,
    angles: Array,
    error: Array,
) -> tuple[int, float, int, int]:
    """Search to the end; write the angles, (8,), and the error of each extremity, (3,).

    Returns how the search ended, the residual, the evaluations and the generations.
    """
    problem: Problem = record[0]
    if not (_bounded(target) and _bounded(start)):
        return REFUSED, np.nan, 0, 0
    best = new_best(start)
    status, generations = begin(problem, target, has_start, best), 0
    if status == GOES_ON:
        population = new_population(problem.individuals, seed)
        status = evolve(problem, target, population, best, problem.generations)
        generations = population.counts[0]
    residual = finish(problem, target, start, has_start, best.pose, angles, error)
    return status, residual, best.evaluations[0], generations


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
    has_start: bool,
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
            record, targets[i], start, has_start, seed, angles[i], errors[i]
        )
        residuals[i] = residual
        counts[i, 0] = status
        counts[i, 1] = evaluations
        counts[i, 2] = generations
