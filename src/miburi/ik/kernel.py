"""The compiled solver: it solves one target after another, each by a search over the waist's angle.

Inputs are a body, as :func:`miburi.ik.problem.pack` packs it, targets, and optionally a present
pose. Outputs are angles, errors, and how each search ended. Importing this module loads Numba,
which compiles each function at its first call, or loads it from the disk.
"""

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from miburi.bma.operators import Ints
from miburi.ground.compiled import compiled
from miburi.ik.limbs import choose_nearest
from miburi.ik.problem import FARTHEST, WORK, Body, Work
from miburi.ik.residuals import note_errors
from miburi.ik.waist import search_waist
from miburi.robot import Array

#: How a search ended; :mod:`miburi.ik.solver` turns it into words.
REFUSED, REACHED, BEST = -1, 0, 1


@compiled
def solve(
    record: NDArray[np.void], target: Array, start: Array, angles: Array, error: Array
) -> tuple[int, float, int]:
    """Find the best pose; of those that reach the same points, the one nearest to ``start``.

    Writes the eight angles, in rad, and the errors of the three extremities, in m. ``start`` is the
    present pose, eight angles in rad. An empty array means that there is no present pose; a flag
    for this would cost 0.1 µs.

    Returns how the search ended, the residual in m, and the evaluations.
    """
    if not (_bounded(target) and _bounded(start)):
        return REFUSED, np.nan, 0
    memory = np.zeros(1, WORK)  # a record alone would not keep it alive
    body: Body = record[0]
    work: Work = memory[0]
    for j in range(9):
        work.target[j] = target[j]
    work.value = np.inf
    search_waist(body, work)
    for j in range(8):
        angles[j] = work.best[j]
    if start.size > 0:
        choose_nearest(body, work, start, angles)
    errors, total = np.empty(9), 0.0
    note_errors(body, target, angles, errors)
    for limb in range(3):
        squared = errors[3 * limb] ** 2 + errors[3 * limb + 1] ** 2 + errors[3 * limb + 2] ** 2
        error[limb] = sqrt(squared)
        total += squared
    residual = sqrt(total)
    return REACHED if residual <= body.reached else BEST, residual, work.evaluations


@compiled
def _bounded(values: Array) -> bool:
    """Return whether all values are numbers, and none is beyond ``FARTHEST``."""
    bounded = True
    for value in values:
        bounded &= -FARTHEST <= value <= FARTHEST
    return bounded


@compiled
def solve_many(
    record: NDArray[np.void],
    targets: Array,
    start: Array,
    angles: Array,
    errors: Array,
    residuals_of: Array,
    counts: Ints,
) -> None:
    """Call :func:`solve` for each row of ``targets``.

    Each row of ``counts`` gets the status and the number of evaluations.
    """
    for i in range(targets.shape[0]):
        status, residual, evaluations = solve(record, targets[i], start, angles[i], errors[i])
        residuals_of[i] = residual
        counts[i, 0], counts[i, 1] = status, evaluations
