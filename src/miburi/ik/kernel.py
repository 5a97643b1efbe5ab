"""The Bacterial Memetic Algorithm compiled around the kinematics of the body.

The operators are those of :mod:`miburi.bma.operators`; here they meet the body's kinematics.
Importing this module loads Numba; it compiles at the first call, unless that was done before and
is found on the disk.
"""

from typing import NamedTuple

import numpy as np

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
from miburi.compiled import compiled
from miburi.ik.kinematics import (
    Body,
    body_step,
    changed,
    changed_in_turn,
    finish,
    know,
    known_pose,
    linearise,
)

#: How a search stands; the words for it are in :mod:`miburi.ik`.
GOES_ON, CONVERGED, SETTLED = 0, 1, 2


class Numbers(NamedTuple):
    """:class:`miburi.bma.Settings` for compiled code."""

    individuals: int
    clones: int
    segment: int
    transfers: int
    transferred: int
    local_probability: float
    local_iterations: int
    damping: float
    gradient_tolerance: float
    by_residual: bool
    ends: int
    local_first: bool
    first_iterations: int
    target: float
    patience: int
    generations: int


class Best(NamedTuple):
    """The best bacterium so far, its value, and how many were evaluated."""

    pose: Array  # (8,)
    value: Array  # (1,)
    evaluations: Ints  # (1,)


@compiled
def _better(best: Best, pose: Array, value: float) -> None:
    if value < best.value[0]:
        best.value[0] = value
        for j in range(8):
            best.pose[j] = pose[j]


@compiled
def _search_by_residual(
    body: Body, target: Array, numbers: Numbers, iterations: int, q: Array, best: Best
) -> float:
    """Levenberg-Marquardt on the residuals, in place; return the value reached."""
    normal, vectors, pose = np.zeros((8, 8)), np.empty((4, 8)), known_pose()
    gradient, free, step, new = vectors[0], vectors[1], vectors[2], vectors[3]
    damping = numbers.damping
    value = linearise(body.lengths, target, q, pose, normal, gradient)
    best.evaluations[0] += 1
    for _ in range(iterations):
        if value <= numbers.target:
            break
        if hold(q, gradient, body.lower, body.upper, free) <= numbers.gradient_tolerance:
            break
        body_step(normal, gradient, free, damping, step)
        predicted = into_box(q, normal, gradient, damping, body.lower, body.upper, step, new)
        new_value = linearise(body.lengths, target, new, pose, normal, gradient)
        best.evaluations[0] += 1
        gain = value - new_value
        damping = damped(damping, -gain, predicted)
        if gain > 0.0:
            value = new_value
            for j in range(8):
                q[j] = new[j]
            if hopeless(value, gain, best.value[0]):
                break
        else:
            linearise(body.lengths, target, q, pose, normal, gradient)
    _better(best, q, value)
    return value


@compiled
def _search_from_ends(
    body: Body, target: Array, numbers: Numbers, iterations: int, q: Array, best: Best
) -> float:
    """Search locally; then go on from clones with one joint at a limit, while that helps."""
    value = _search_by_residual(body, target, numbers, iterations, q, best)
    if numbers.ends == 0 or value <= numbers.target:
        return value
    clones, values, tried = np.empty((16, 8)), np.empty((3, 16)), np.empty(16, np.int64)
    pose = known_pose()
    for _ in range(SWEEPS):
        ends(q, body.lower, body.upper, clones)
        know(body.lengths, target, q, pose)
        changed_in_turn(body.lengths, target, clones, pose, values)
        tried[:] = 0
        best.evaluations[0] += 16
        better = False
        for _ in range(numbers.ends):
            i = most_promising(q, body.lower, body.upper, values[0], tried)
            if i < 0:
                break
            tried[i] = 1
            new = clones[i]
            new_value = _search_by_residual(body, target, numbers, iterations, new, best)
            better = new_value < value * (1.0 - SLIGHT)
            if better:
                value = new_value
                for j in range(8):
                    q[j] = new[j]
                break
        if not better or value <= numbers.target:
            break
    return value


@compiled
def _search_as_printed(
    body: Body,
    target: Array,
    numbers: Numbers,
    iterations: int,
    q: Array,
    value: float,
    best: Best,
) -> float:
    """Eq. 12 with central differences, in place; return the value reached."""
    points, values, jacobian = np.empty((16, 8)), np.empty((3, 16)), np.empty((1, 8))
    pose, new, gradient = known_pose(), np.empty(8), jacobian[0]
    damping, accepted = numbers.damping, True
    for _ in range(iterations):
        if accepted:
            stencil(q, body.lower, body.upper, points)
            know(body.lengths, target, q, pose)
            changed_in_turn(body.lengths, target, points, pose, values)
            best.evaluations[0] += 16
            differences(points, values[:1].T, jacobian)
        if length(gradient) <= numbers.gradient_tolerance:
            break
        predicted = printed_step(q, gradient, damping, body.lower, body.upper, new)
        new_value = know(body.lengths, target, new, pose)
        best.evaluations[0] += 1
        damping = damped(damping, new_value - value, predicted)
        accepted = new_value < value
        if accepted:
            value = new_value
            for j in range(8):
                q[j] = new[j]
    _better(best, q, value)
    return value


@compiled
def _populate(
    body: Body, target: Array, population: Array, costs: Array, state: State, best: Best
) -> None:
    pose = known_pose()
    populate(population, body.lower, body.upper, state)
    if best.value[0] < np.inf:
        population[-1] = best.pose
    for i in range(costs.size):
        costs[i] = know(body.lengths, target, population[i], pose)
        _better(best, population[i], costs[i])
    best.evaluations[0] += costs.size


@compiled
def _search_locally(
    body: Body,
    target: Array,
    numbers: Numbers,
    iterations: int,
    q: Array,
    value: float,
    best: Best,
) -> float:
    if numbers.by_residual:
        return _search_from_ends(body, target, numbers, iterations, q, best)
    return _search_as_printed(body, target, numbers, iterations, q, value, best)


@compiled
def _mutate_all(
    body: Body,
    target: Array,
    numbers: Numbers,
    population: Array,
    costs: Array,
    genes: Ints,
    state: State,
    best: Best,
) -> None:
    """Bacterial mutation of every bacterium, segment by segment in random order."""
    clones, tried = np.empty((numbers.clones - 1, 8)), np.empty((3, numbers.clones - 1))
    pose = known_pose()
    for i in range(costs.size):
        bacterium = population[i]
        know(body.lengths, target, bacterium, pose)
        shuffle(genes, state)
        for first in range(0, 8, numbers.segment):
            segment = genes[first : first + numbers.segment]
            mutate(bacterium, segment, body.lower, body.upper, state, clones)
            if segment.size == 1:
                changed(body.lengths, target, clones, segment[0], pose, tried)
            else:
                for k in range(clones.shape[0]):
                    tried[0, k] = know(body.lengths, target, clones[k], pose)
            found = -1
            for k in range(clones.shape[0]):
                if tried[0, k] < costs[i]:
                    costs[i], found = tried[0, k], k
            best.evaluations[0] += clones.shape[0]
            if found >= 0:
                for j in range(8):
                    bacterium[j] = clones[found, j]
                know(body.lengths, target, bacterium, pose)
        _better(best, bacterium, costs[i])


@compiled
def _transfer_genes(
    body: Body,
    target: Array,
    numbers: Numbers,
    population: Array,
    costs: Array,
    genes: Ints,
    state: State,
    best: Best,
) -> None:
    pose = known_pose()
    rank(population, costs)
    for _ in range(numbers.transfers):
        taker = transfer(population, numbers.transferred, genes, state)
        costs[taker] = know(body.lengths, target, population[taker], pose)
        best.evaluations[0] += 1
        _better(best, population[taker], costs[taker])
        rank(population, costs)


@compiled
def _generation(
    body: Body,
    target: Array,
    numbers: Numbers,
    population: Array,
    costs: Array,
    counts: Ints,
    genes: Ints,
    state: State,
    best: Best,
) -> int:
    """Apply the three operators; return how the search stands, as soon as it is over."""
    if not numbers.local_first:
        _mutate_all(body, target, numbers, population, costs, genes, state, best)
    for i in range(costs.size):
        if best.value[0] <= numbers.target:
            return CONVERGED
        if uniform(state) < numbers.local_probability:
            before = best.value[0]
            costs[i] = _search_locally(
                body, target, numbers, numbers.local_iterations, population[i], costs[i], best
            )
            counts[1] = 0 if best.value[0] < before * (1.0 - SLIGHT) else counts[1] + 1
            if best.value[0] > numbers.target and 0 < numbers.patience <= counts[1]:
                return SETTLED
    if numbers.local_first and best.value[0] > numbers.target:
        _mutate_all(body, target, numbers, population, costs, genes, state, best)
    if best.value[0] > numbers.target:
        _transfer_genes(body, target, numbers, population, costs, genes, state, best)
    return CONVERGED if best.value[0] <= numbers.target else GOES_ON


@compiled
def _begin(body: Body, target: Array, numbers: Numbers, has_start: bool, best: Best) -> int:
    """Search locally from the pose in ``best``, and where that was given, from the middle too."""
    best.value[0] = np.inf
    if has_start or (numbers.first_iterations > 0 and not numbers.by_residual):
        best.value[0] = know(body.lengths, target, best.pose, known_pose())
        best.evaluations[0] += 1
    if numbers.first_iterations > 0:
        pose, value = best.pose.copy(), best.value[0]
        _search_locally(body, target, numbers, numbers.first_iterations, pose, value, best)
        if has_start and best.value[0] > numbers.target:
            pose = 0.5 * (body.lower + body.upper)
            value = know(body.lengths, target, pose, known_pose())
            _search_locally(body, target, numbers, numbers.first_iterations, pose, value, best)
    return CONVERGED if best.value[0] <= numbers.target else GOES_ON


@compiled
def _evolve(
    body: Body,
    target: Array,
    numbers: Numbers,
    population: Array,
    costs: Array,
    counts: Ints,
    genes: Ints,
    state: State,
    best: Best,
    generations: int,
) -> int:
    """Run ``generations`` more; return how the search stands.

    ``counts`` are the generations begun, -1 before there is a population, and the local searches
    in a row that found nothing better.
    """
    if counts[0] < 0:
        counts[0] = counts[1] = 0
        _populate(body, target, population, costs, state, best)
    for _ in range(generations):
        counts[0] += 1
        status = _generation(body, target, numbers, population, costs, counts, genes, state, best)
        if status != GOES_ON:
            return status
    return GOES_ON


@compiled
def _unpacked(problem: Array) -> tuple[Body, Numbers]:
    """Read what :mod:`miburi.ik` packed: lengths, least and greatest angles, settings."""
    numbers = Numbers(
        individuals=int(problem[22]),
        clones=int(problem[23]),
        segment=int(problem[24]),
        transfers=int(problem[25]),
        transferred=int(problem[26]),
        local_probability=problem[27],
        local_iterations=int(problem[28]),
        damping=problem[29],
        gradient_tolerance=problem[30],
        by_residual=problem[31] == 1.0,
        ends=int(problem[32]),
        local_first=problem[33] == 1.0,
        first_iterations=int(problem[34]),
        target=problem[35],
        patience=int(problem[36]),
        generations=int(problem[37]),
    )
    return Body(problem[:6], problem[6:14], problem[14:22]), numbers


@compiled
def solve(
    problem: Array, target: Array, start: Array, has_start: bool, seed: int, found: Array
) -> tuple[int, float, int, int]:
    """Search to the end; write pose and errors, (11,).

    Returns how it stands, the residual, the evaluations and the generations.
    """
    body, numbers = _unpacked(problem)
    best = Best(start.copy(), np.empty(1), np.zeros(1, np.int64))
    status, done = _begin(body, target, numbers, has_start, best), 0
    if status == GOES_ON:
        counts = np.full(2, -1)
        state = np.full(1, np.uint64(seed))
        population, costs = np.empty((numbers.individuals, 8)), np.empty(numbers.individuals)
        genes, left = np.arange(8), numbers.generations
        status = _evolve(body, target, numbers, population, costs, counts, genes, state, best, left)
        done = counts[0]
    residual = finish(body, target, start, has_start, best.pose, found)
    return status, residual, best.evaluations[0], done


@compiled
def solve_many(
    problem: Array,
    targets: Array,
    start: Array,
    has_start: bool,
    seed: int,
    found: Array,
    residuals: Array,
    counts: Ints,
) -> None:
    """Call :func:`solve` for every row; write (n, 11), (n,), and (n, 3) status and counts."""
    for i in range(targets.shape[0]):
        status, residual, evaluations, generations = solve(
            problem, targets[i], start, has_start, seed, found[i]
        )
        residuals[i] = residual
        counts[i, 0] = status
        counts[i, 1] = evaluations
        counts[i, 2] = generations


@compiled
def advance(
    problem: Array,
    target: Array,
    start: Array,
    has_start: bool,
    state: State,
    value: Array,
    population: Array,
    costs: Array,
    counts: Ints,
    genes: Ints,
    pose: Array,
    found: Array,
) -> tuple[int, float]:
    """Search a little further, for who watches the clock: the beginning, then a generation.

    ``counts`` holds the generations done, those without gain, and the evaluations; (-2, 0, 0)
    begins, with ``pose`` at the start. Everything from ``state`` to ``pose`` is kept between
    calls. Returns how the search stands and the residual; writes pose and errors, (11,).
    """
    body, numbers = _unpacked(problem)
    best = Best(pose, value, np.zeros(1, np.int64))
    if counts[0] == -2:
        status = _begin(body, target, numbers, has_start, best)
        counts[0] = -1
    else:
        status = _evolve(body, target, numbers, population, costs, counts, genes, state, best, 1)
    counts[2] += best.evaluations[0]
    return status, finish(body, target, start, has_start, pose.copy(), found)
