"""The Bacterial Memetic Algorithm compiled around the kinematics of the body.

The operators are those of :mod:`miburi.bma_operators`; here is what evaluates their points. Each
limb's coordinates are taken in the frame that turns with the waist (out of the shoulder, forward,
up): lengths of errors, and so Eq. 13, do not depend on the frame. Importing this module loads
Numba; it compiles at the first call, unless that was done before and is found on the disk.
"""

from math import atan2, cos, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from miburi.bma_operators import (
    Array,
    Ints,
    State,
    damped,
    differences,
    free_length,
    length,
    mutate,
    populate,
    printed_step,
    rank,
    residual_step,
    shuffle,
    stencil,
    transfer,
    uniform,
)
from miburi.compiled import compiled

#: How a search stands; the words for it are in :mod:`miburi.ik`.
GOES_ON, CONVERGED, SETTLED = 0, 1, 2
#: The operators, by their numbers in ``Numbers.order``.
MUTATION, LOCAL_SEARCH, GENE_TRANSFER = 0, 1, 2


class Body(NamedTuple):
    """The six lengths of Section 3, (6,) m, and Table 1, (8,) rad each."""

    lengths: Array
    lower: Array
    upper: Array


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
    first_iterations: int
    target: float
    patience: int
    order: Ints


class Best(NamedTuple):
    """The best bacterium so far, its value, and how many were evaluated."""

    pose: Array  # (8,)
    value: Array  # (1,)
    evaluations: Ints  # (1,)


@compiled
def _arm(lengths: Array, s: float, e: float, f: float) -> tuple[float, float, float]:
    """Return the hand out of the shoulder's side, forward, and up from the shoulder axis."""
    along = lengths[1] + lengths[2] * cos(e) + lengths[3] * cos(e + f)
    out = lengths[2] * sin(e) + lengths[3] * sin(e + f)
    return along, out * sin(s), -out * cos(s)


@compiled
def _turn(target: Array, waist: float, turned: Array) -> None:
    """Write the target, (9,), in the frames that turn with the waist."""
    sw, cw = sin(waist), cos(waist)
    turned[0] = target[0] * sw - target[1] * cw
    turned[1] = target[0] * cw + target[1] * sw
    turned[2] = target[2]
    turned[3] = target[4] * cw - target[3] * sw
    turned[4] = target[3] * cw + target[4] * sw
    turned[5] = target[5]
    turned[6] = target[7] * cw - target[6] * sw
    turned[7] = target[6] * cw + target[7] * sw
    turned[8] = target[8]


@compiled
def _limb(lengths: Array, q: Array, limb: int, place: Array) -> None:
    """Write where an extremity is (0 right, 1 left, 2 head), in the turned frame."""
    if limb == 0:
        place[0], place[1], up = _arm(lengths, q[1], q[2], q[3])
        place[2] = lengths[0] + up
    elif limb == 1:
        place[3], place[4], up = _arm(lengths, q[4], -q[5], -q[6])
        place[5] = lengths[0] + up
    else:
        place[6] = 0.0
        place[7] = lengths[5] * cos(q[7])
        place[8] = lengths[0] + lengths[4] + lengths[5] * sin(q[7])


@compiled
def _squared(place: Array, turned: Array, limb: int) -> float:
    total = 0.0
    for i in range(3 * limb, 3 * limb + 3):
        total += (place[i] - turned[i]) ** 2
    return total


@compiled
def _place(lengths: Array, target: Array, q: Array, place: Array, turned: Array) -> float:
    """Write where the extremities are and belong; return the sum of squared errors (Eq. 13)."""
    _turn(target, q[0], turned)
    total = 0.0
    for limb in range(3):
        _limb(lengths, q, limb, place)
        total += _squared(place, turned, limb)
    return total


@compiled
def _linearise(lengths: Array, target: Array, q: Array, normal: Array, gradient: Array) -> float:
    """Write JᵀJ (its lower triangle) and the gradient of Eq. 13, 2 Jᵀe; return Eq. 13.

    J has three rows a limb; an arm's depend on the waist and on the arm's three joints.
    """
    turned = np.empty(9)
    normal_ww = gradient_w = 0.0
    total: float = 0.0
    _turn(target, q[0], turned)
    rows = np.empty((3, 4))
    error = np.empty(3)
    for limb in range(2):
        first = 1 + 3 * limb
        side = 1.0 - 2.0 * limb
        s, e, f = q[first], side * q[first + 1], side * q[first + 2]
        ss, cs, se, ce, sef, cef = sin(s), cos(s), sin(e), cos(e), sin(e + f), cos(e + f)
        along = lengths[1] + lengths[2] * ce + lengths[3] * cef
        out = lengths[2] * se + lengths[3] * sef
        error[0] = along - turned[3 * limb]
        error[1] = out * ss - turned[3 * limb + 1]
        error[2] = lengths[0] - out * cs - turned[3 * limb + 2]
        along_f, out_f = -side * lengths[3] * sef, side * lengths[3] * cef
        along_e, out_e = along_f - side * lengths[2] * se, out_f + side * lengths[2] * ce
        rows[0, 0], rows[1, 0], rows[2, 0] = -side * out * ss, side * along, 0.0
        rows[0, 1], rows[1, 1], rows[2, 1] = 0.0, out * cs, out * ss
        rows[0, 2], rows[1, 2], rows[2, 2] = along_e, out_e * ss, -out_e * cs
        rows[0, 3], rows[1, 3], rows[2, 3] = along_f, out_f * ss, -out_f * cs
        for a in range(4):
            slope = rows[0, a] * error[0] + rows[1, a] * error[1] + rows[2, a] * error[2]
            if a == 0:
                gradient_w += slope
            else:
                gradient[first + a - 1] = 2.0 * slope
            for b in range(a + 1):
                product = rows[0, a] * rows[0, b] + rows[1, a] * rows[1, b]
                product += rows[2, a] * rows[2, b]
                if a == 0:
                    normal_ww += product
                else:
                    normal[first + a - 1, 0 if b == 0 else first + b - 1] = product
        total += error[0] ** 2 + error[1] ** 2 + error[2] ** 2
    for i in range(4, 7):
        for j in range(1, 4):
            normal[i, j] = 0.0
    sh, ch = lengths[5] * sin(q[7]), lengths[5] * cos(q[7])
    error[0], error[1] = -turned[6], ch - turned[7]
    error[2] = lengths[0] + lengths[4] + sh - turned[8]
    for j in range(7):
        normal[7, j] = 0.0
    normal[7, 7] = sh * sh + ch * ch
    normal[0, 0] = normal_ww + ch * ch
    gradient[0] = 2.0 * (gradient_w + ch * error[0])
    gradient[7] = 2.0 * (ch * error[2] - sh * error[1])
    total += error[0] ** 2 + error[1] ** 2 + error[2] ** 2
    return total


@compiled
def _changed(
    lengths: Array, target: Array, q: Array, gene: int, place: Array, turned: Array, limbs: Array
) -> float:
    """Return Eq. 13 for a pose that differs in one gene from the one at ``place``.

    ``place``, ``turned`` and ``limbs`` (the squared error of each limb) hold that one; what
    belongs to the changed gene is overwritten, which the next change of the same gene may do too.
    """
    if gene == 0:
        _turn(target, q[0], turned)
        return _squared(place, turned, 0) + _squared(place, turned, 1) + _squared(place, turned, 2)
    limb = 0 if gene < 4 else 1 if gene < 7 else 2
    _limb(lengths, q, limb, place)
    total: float = limbs[0] + limbs[1] + limbs[2] - limbs[limb] + _squared(place, turned, limb)
    return total


@compiled
def _remember(
    lengths: Array, target: Array, q: Array, place: Array, turned: Array, limbs: Array
) -> None:
    _place(lengths, target, q, place, turned)
    for limb in range(3):
        limbs[limb] = _squared(place, turned, limb)


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
    normal, new_normal, matrix = np.empty((8, 8)), np.empty((8, 8)), np.empty((8, 8))
    gradient, new_gradient, new = np.empty(8), np.empty(8), np.empty(8)
    damping = numbers.damping
    value = _linearise(body.lengths, target, q, normal, gradient)
    best.evaluations[0] += 1
    for _ in range(iterations):
        if value <= numbers.target:
            break
        if free_length(q, gradient, body.lower, body.upper) <= numbers.gradient_tolerance:
            break
        predicted = residual_step(q, normal, gradient, damping, body.lower, body.upper, matrix, new)
        new_value = _linearise(body.lengths, target, new, new_normal, new_gradient)
        best.evaluations[0] += 1
        damping = damped(damping, new_value - value, predicted)
        if new_value < value:
            value = new_value
            for j in range(8):
                q[j] = new[j]
            normal, new_normal = new_normal, normal
            gradient, new_gradient = new_gradient, gradient
    _better(best, q, value)
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
    points, values, jacobian = np.empty((16, 8)), np.empty((16, 1)), np.empty((1, 8))
    place, turned, limbs, new = np.empty(9), np.empty(9), np.empty(3), np.empty(8)
    gradient = jacobian[0]
    damping, accepted = numbers.damping, True
    for _ in range(iterations):
        if accepted:
            stencil(q, body.lower, body.upper, points)
            for gene in range(8):
                _remember(body.lengths, target, q, place, turned, limbs)
                for i in (2 * gene, 2 * gene + 1):
                    values[i, 0] = _changed(
                        body.lengths, target, points[i], gene, place, turned, limbs
                    )
            best.evaluations[0] += 16
            differences(points, values, jacobian)
        if length(gradient) <= numbers.gradient_tolerance:
            break
        predicted = printed_step(q, gradient, damping, body.lower, body.upper, new)
        new_value = _place(body.lengths, target, new, place, turned)
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
    clones = np.empty((numbers.clones - 1, 8))
    place, turned, limbs = np.empty(9), np.empty(9), np.empty(3)
    for i in range(costs.size):
        bacterium = population[i]
        shuffle(genes, state)
        for first in range(0, 8, numbers.segment):
            segment = genes[first : first + numbers.segment]
            mutate(bacterium, segment, body.lower, body.upper, state, clones)
            if segment.size == 1:
                _remember(body.lengths, target, bacterium, place, turned, limbs)
            found = -1
            for k in range(clones.shape[0]):
                if segment.size == 1:
                    value = _changed(
                        body.lengths, target, clones[k], segment[0], place, turned, limbs
                    )
                else:
                    value = _place(body.lengths, target, clones[k], place, turned)
                if value < costs[i]:
                    costs[i] = value
                    found = k
            best.evaluations[0] += clones.shape[0]
            if found >= 0:
                bacterium[:] = clones[found]
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
    place, turned = np.empty(9), np.empty(9)
    rank(population, costs)
    for _ in range(numbers.transfers):
        taker = transfer(population, numbers.transferred, genes, state)
        costs[taker] = _place(body.lengths, target, population[taker], place, turned)
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
    genes: Ints,
    state: State,
    best: Best,
) -> None:
    """Apply the operators in their order; stop as soon as the target value is met."""
    for operator in numbers.order:
        if operator == MUTATION:
            _mutate_all(body, target, numbers, population, costs, genes, state, best)
        elif operator == GENE_TRANSFER:
            _transfer_genes(body, target, numbers, population, costs, genes, state, best)
        else:
            for i in range(costs.size):
                if best.value[0] <= numbers.target:
                    return
                if uniform(state) < numbers.local_probability:
                    if numbers.by_residual:
                        costs[i] = _search_by_residual(
                            body, target, numbers, numbers.local_iterations, population[i], best
                        )
                    else:
                        costs[i] = _search_as_printed(
                            body,
                            target,
                            numbers,
                            numbers.local_iterations,
                            population[i],
                            costs[i],
                            best,
                        )
        if best.value[0] <= numbers.target:
            return


@compiled
def _begin(body: Body, target: Array, numbers: Numbers, best: Best) -> int:
    """Evaluate the starting pose and search locally from it."""
    best.value[0] = _place(body.lengths, target, best.pose, np.empty(9), np.empty(9))
    best.evaluations[0] = 1
    if numbers.first_iterations > 0 and best.value[0] > numbers.target:
        pose = best.pose.copy()
        if numbers.by_residual:
            best.evaluations[0] = 0
            _search_by_residual(body, target, numbers, numbers.first_iterations, pose, best)
        else:
            _search_as_printed(
                body, target, numbers, numbers.first_iterations, pose, best.value[0], best
            )
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
    """Run ``generations`` more; ``counts`` are those done, from -1, and those without gain."""
    if counts[0] < 0:
        counts[0] = counts[1] = 0
        populate(population, body.lower, body.upper, state)
        population[0] = best.pose
        for i in range(costs.size):
            costs[i] = _place(body.lengths, target, population[i], np.empty(9), np.empty(9))
            _better(best, population[i], costs[i])
        best.evaluations[0] += costs.size
    for _ in range(generations):
        before = best.value[0]
        _generation(body, target, numbers, population, costs, genes, state, best)
        if best.value[0] <= numbers.target:
            return CONVERGED
        counts[0] += 1
        counts[1] = 0 if best.value[0] < before else counts[1] + 1
        if 0 < numbers.patience <= counts[1]:
            return SETTLED
    return GOES_ON


@compiled
def _finish(
    body: Body, target: Array, has_start: bool, start: Array, best: Best, found: Array
) -> float:
    """Choose the pose nearest to ``start``; write pose and errors; return the residual."""
    if has_start:
        _nearest_arm(body, start, best.pose, 1, 1.0)
        _nearest_arm(body, start, best.pose, 4, -1.0)
    place, turned = np.empty(9), np.empty(9)
    total = _place(body.lengths, target, best.pose, place, turned)
    for j in range(8):
        found[j] = best.pose[j]
    for limb in range(3):
        found[8 + limb] = sqrt(_squared(place, turned, limb))
    return sqrt(total)


@compiled
def _nearest_arm(body: Body, start: Array, q: Array, first: int, side: float) -> None:
    """Replace an arm's pose by that one of the same hand position which is nearest to ``start``.

    The elbow mirrored about the line to the hand, the shoulder turned by π, and both: no other
    pose of an arm, with the waist where it is, puts the hand on the same point. With the hand on
    the shoulder axis any shoulder angle will do.
    """
    s, e, f = q[first], side * q[first + 1], side * q[first + 2]
    reach = body.lengths[2] * cos(e) + body.lengths[3] * cos(e + f)
    out = body.lengths[2] * sin(e) + body.lengths[3] * sin(e + f)
    bearing = atan2(out, reach)
    on_axis = abs(out) < 1e-9
    shortest = np.inf
    found, arm = np.empty(3), np.empty(3)
    for turn in (0.0, pi, -pi):
        sign = 1.0 if turn == 0.0 else -1.0
        for mirror in (1.0, -1.0):
            arm[0] = s + turn
            if on_axis:
                arm[0] = min(max(start[first], body.lower[first]), body.upper[first])
            arm[1] = side * sign * (e if mirror > 0 else _wrapped(2 * bearing - e))
            arm[2] = side * sign * mirror * f
            distance = 0.0
            for k in range(3):
                distance += (arm[k] - start[first + k]) ** 2
                if arm[k] < body.lower[first + k] or arm[k] > body.upper[first + k]:
                    distance = np.inf
            if distance < shortest:
                shortest = distance
                for k in range(3):
                    found[k] = arm[k]
    if shortest < np.inf:
        for k in range(3):
            q[first + k] = found[k]


@compiled
def _wrapped(angle: float) -> float:
    return (angle + pi) % (2 * pi) - pi


@compiled
def _numbers(ints: Ints, floats: Array) -> Numbers:
    return Numbers(
        individuals=ints[0],
        clones=ints[1],
        segment=ints[2],
        transfers=ints[3],
        transferred=ints[4],
        local_probability=floats[0],
        local_iterations=ints[5],
        damping=floats[1],
        gradient_tolerance=floats[2],
        by_residual=ints[6] == 1,
        first_iterations=ints[7],
        target=floats[3],
        patience=ints[8],
        order=ints[10:],
    )


@compiled
def solve(
    lengths: Array,
    lower: Array,
    upper: Array,
    ints: Ints,
    floats: Array,
    target: Array,
    start: Array,
    has_start: bool,
    seed: int,
    found: Array,
) -> tuple[int, float, int, int]:
    """Search to the end; write pose and errors, (11,).

    Returns how it stands, the residual, the evaluations and the generations.
    """
    body, numbers = Body(lengths, lower, upper), _numbers(ints, floats)
    best = Best(start.copy(), np.empty(1), np.zeros(1, np.int64))
    status, done = _begin(body, target, numbers, best), 0
    if status == GOES_ON:
        counts = np.full(2, -1)
        state = np.full(1, np.uint64(seed))
        population, costs = np.empty((numbers.individuals, 8)), np.empty(numbers.individuals)
        status = _evolve(
            body,
            target,
            numbers,
            population,
            costs,
            counts,
            np.arange(8),
            state,
            best,
            ints[9],
        )
        done = counts[0]
    residual = _finish(body, target, has_start, start, best, found)
    return status, residual, best.evaluations[0], done


@compiled
def solve_many(
    lengths: Array,
    lower: Array,
    upper: Array,
    ints: Ints,
    floats: Array,
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
            lengths, lower, upper, ints, floats, targets[i], start, has_start, seed, found[i]
        )
        residuals[i] = residual
        counts[i, 0] = status
        counts[i, 1] = evaluations
        counts[i, 2] = generations


@compiled
def advance(
    lengths: Array,
    lower: Array,
    upper: Array,
    ints: Ints,
    floats: Array,
    target: Array,
    start: Array,
    has_start: bool,
    state: State,
    found: Array,
    population: Array,
    costs: Array,
    counts: Ints,
    genes: Ints,
) -> tuple[int, float]:
    """Search a little further, for who watches the clock: the beginning, then a generation.

    ``counts`` holds the generations done, those without gain, and the evaluations; (-2, 0, 0)
    begins. ``state``, ``found``, ``population``, ``costs`` and ``genes`` are kept between calls.
    """
    body, numbers = Body(lengths, lower, upper), _numbers(ints, floats)
    best = Best(found[:8].copy(), np.empty(1), np.zeros(1, np.int64))
    if counts[0] == -2:
        status = _begin(body, target, numbers, best)
        counts[0] = -1
    else:
        best.value[0] = _place(lengths, target, best.pose, np.empty(9), np.empty(9))
        status = _evolve(body, target, numbers, population, costs, counts, genes, state, best, 1)
    counts[2] += best.evaluations[0]
    residual = _finish(body, target, has_start and status != GOES_ON, start, best, found)
    return status, residual
