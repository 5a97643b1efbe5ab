"""Are the gestures told apart by their motion alone? A nearest-neighbour classifier.

It sees of each performance what an observer without labels could: Laban's measures and the mean
posture. It learns performances at two moods and names others, with variations that it has not
seen, at moods that it has not seen.
"""

from collections.abc import Sequence
from dataclasses import astuple

import numpy as np
from numpy.typing import NDArray

from miburi.feelings import FEELINGS
from miburi.gestures import MovementFunction, Repertoire, key_poses
from miburi.robot import Array, Robot
from miburi.studies.gestures.rehearsal import Rehearsal, rehearse

__all__ = ["LEARNT_MOODS", "NearestNeighbour", "confusion", "features", "learn"]

#: The moods whose performances are learnt (the issue's choice, not the paper's).
LEARNT_MOODS = (0.5, 0.9)


def features(robot: Robot, rehearsal: Rehearsal) -> Array:
    """Describe a performance, (24,): the measures, and how the body stood.

    The eight measures are taken as logarithms, as they span decades. The mean posture is the
    mean of the joint angles away from neutral, and the widest posture the joint angles at their
    farthest; both are divided by the largest of their angles, so that they say how the body
    stood and leave how much to the measures.
    """
    offset = rehearsal.angles - robot.neutral
    mean = offset.mean(axis=0)
    widest = offset[np.abs(offset).max(axis=1).argmax()]
    measures = np.log(np.array(astuple(rehearsal.measures)) + 1e-9)
    return np.concatenate([measures, *(_shape(posture) for posture in (mean, widest))])


def _shape(posture: Array) -> Array:
    largest: Array = posture / max(float(np.abs(posture).max()), 1e-9)
    return largest


class NearestNeighbour:
    """Name what is closest among the learnt, each feature scaled by its spread.

    Parameters
    ----------
    rows, names
        What is learnt: (n, k) features, and n names.
    """

    def __init__(self, rows: Array, names: Sequence[str]) -> None:
        self._mean, self._spread = rows.mean(axis=0), rows.std(axis=0) + 1e-9
        self._rows, self._names = (rows - self._mean) / self._spread, list(names)

    def name(self, row: Array) -> str:
        """Name one performance, given its features (k,)."""
        scaled = (row - self._mean) / self._spread
        return self._names[int(np.linalg.norm(self._rows - scaled, axis=1).argmin())]


def learn(
    robot: Robot, repertoire: Repertoire, *, variations: int = 6, seed: int = 0
) -> NearestNeighbour:
    """Learn every gesture at the moods 0.5 and 0.9, each in so many variations."""
    rows, names = [], []
    for function in repertoire.functions:
        for mood in LEARNT_MOODS:
            for number in range(variations):
                rows.append(_performed(robot, function, mood, seed + number))
                names.append(function.feeling)
    return NearestNeighbour(np.array(rows), names)


def confusion(
    robot: Robot,
    repertoire: Repertoire,
    classifier: NearestNeighbour,
    mood: float,
    *,
    variations: int = 10,
    seed: int = 1000,
) -> NDArray[np.int64]:
    """Count, (8, 8), what was performed (rows) and what it was named (columns), as FEELINGS.

    The seeds of the variations must not be among those learnt.
    """
    table = np.zeros((len(FEELINGS), len(FEELINGS)), dtype=np.int64)
    for function in repertoire.functions:
        row = FEELINGS.index(function.feeling)
        for number in range(variations):
            named = classifier.name(_performed(robot, function, mood, seed + number))
            table[row, FEELINGS.index(named)] += 1
    return table


def _performed(robot: Robot, function: MovementFunction, mood: float, variation: int) -> Array:
    performance = key_poses(robot, function, mood, variation=variation)
    return features(robot, rehearse(robot, performance))
