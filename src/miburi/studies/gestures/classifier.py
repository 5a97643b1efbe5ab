"""Tell gestures apart by their motion alone, with a nearest-neighbour classifier.

The features of a performance are Laban's measures, its mean posture and its widest posture. The
classifier learns every gesture at two moods, and is tested at another mood, with other variations.
"""

from collections.abc import Sequence
from dataclasses import astuple
from itertools import product

import numpy as np
from numpy.typing import NDArray

from miburi.bodies.rehearsal import PERIOD, rehearse
from miburi.feelings import FEELINGS
from miburi.gestures import MovementFunction, Repertoire, key_poses
from miburi.robot import Array, Robot
from miburi.studies.gestures.measures import measure

#: The moods at which the classifier learns (our choice).
_LEARNT_MOODS = (0.5, 0.9)


class NearestNeighbour:
    """Names a performance after the nearest learnt one, with each feature scaled by its spread.

    It learns from the features of n performances, ``rows`` (n, k), and their n ``names``.
    """

    def __init__(self, rows: Array, names: Sequence[str]) -> None:
        self._mean, self._spread = rows.mean(axis=0), rows.std(axis=0) + 1e-9
        self._rows, self._names = (rows - self._mean) / self._spread, list(names)

    def name(self, row: Array) -> str:
        """Return the name for a performance's features (k,)."""
        scaled = (row - self._mean) / self._spread
        return self._names[int(np.linalg.norm(self._rows - scaled, axis=1).argmin())]


def learn(
    robot: Robot, repertoire: Repertoire, *, variations: int, seed: int = 0
) -> NearestNeighbour:
    """Learn every gesture at the moods 0.5 and 0.9, each in ``variations`` variations."""
    each = list(product(repertoire.functions, _LEARNT_MOODS, range(seed, seed + variations)))
    rows = np.array([_features(robot, *one) for one in each])
    return NearestNeighbour(rows, [function.feeling for function, *_ in each])


def confusion(
    robot: Robot,
    repertoire: Repertoire,
    classifier: NearestNeighbour,
    mood: float,
    *,
    variations: int,
    seed: int = 1000,
) -> NDArray[np.int64]:
    """Return how often each gesture (row) got each name (column), in the order of FEELINGS.

    The seeds of the variations must not be among the learnt ones.
    """
    table = np.zeros((len(FEELINGS), len(FEELINGS)), dtype=np.int64)
    for function in repertoire.functions:
        row = FEELINGS.index(function.feeling)
        for number in range(variations):
            named = classifier.name(_features(robot, function, mood, seed + number))
            table[row, FEELINGS.index(named)] += 1
    return table


def _features(robot: Robot, function: MovementFunction, mood: float, variation: int) -> Array:
    """Return the features of a performance, (24,): eight measures and two postures.

    The measures are logarithms, as they span decades. The mean posture is the mean of the joint
    angles, and the widest posture the joint angles at their farthest, both relative to neutral.
    Each posture is divided by its largest angle: it gives the shape, the measures give the size.
    """
    rehearsal = rehearse(robot, key_poses(robot, function, mood, variation=variation))
    offset = rehearsal.angles - robot.neutral
    widest = offset[np.abs(offset).max(axis=1).argmax()]
    measures = np.log(np.array(astuple(measure(rehearsal.positions, PERIOD))) + 1e-9)
    postures = [each / max(np.abs(each).max(), 1e-9) for each in (offset.mean(axis=0), widest)]
    return np.concatenate([measures, *postures])
