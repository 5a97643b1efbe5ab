"""What the compiled search reads: a robot's body and the settings, as one record.

Python packs it once for each robot and settings (:func:`pack`); the compiled functions read its
fields by name. It is a structured array with one row, because Numba takes an array at little
cost: a call with the record as a NamedTuple takes 2 µs more, which is 40 % of a solution.
"""

from typing import NamedTuple, get_type_hints

import numpy as np
from numpy.typing import NDArray

from miburi.bma.settings import Settings
from miburi.robot import Array, Robot
from miburi.robot.description import Lengths

__all__ = ["Problem", "pack"]


class Problem(NamedTuple):
    """The record's fields: the body, and :class:`miburi.bma.Settings` by the same names."""

    size: Lengths
    lower: Array  # (8,) rad, Table 1
    upper: Array  # (8,) rad
    by_residual: bool  # whether Settings.local_search is "residual"
    individuals: int
    clones: int
    segment: int
    transfers: int
    transferred: int
    local_probability: float
    local_iterations: int
    damping: float
    gradient_tolerance: float
    ends: int
    local_first: bool
    first_iterations: int
    enough: float  # Settings.target: a search that comes down to this value has converged
    patience: int
    generations: int


_TYPES = {
    Lengths: np.dtype([(name, np.float64) for name in Lengths.model_fields]),
    Array: np.dtype((np.float64, 8)),
    float: np.float64,
    int: np.int64,
    bool: np.bool_,
}
_RECORD = np.dtype(
    [(name, _TYPES[kind]) for name, kind in get_type_hints(Problem).items()], align=True
)


def pack(robot: Robot, settings: Settings) -> NDArray[np.void]:
    """Return the record, (1,)."""
    values = vars(settings) | {
        "size": tuple(robot.lengths.model_dump().values()),
        "lower": robot.lower,
        "upper": robot.upper,
        "by_residual": settings.local_search == "residual",
        "enough": settings.target,
    }
    return np.array([tuple(values[name] for name in Problem._fields)], _RECORD)
