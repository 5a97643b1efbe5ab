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

__all__ = ["FARTHEST", "RECORD", "Problem", "pack"]

#: No coordinate of a target may be larger, in m: its square must stay a number.
FARTHEST = 1e9


class Problem(NamedTuple):
    """The record's fields: the body, and :class:`miburi.bma.Settings` by the same names."""

    size: Lengths
    lower: Array  # (8,) rad, Table 1
    upper: Array  # (8,) rad
    by_structure: bool  # whether the search knows more of the body than how to evaluate it
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
RECORD = np.dtype(
    [(name, _TYPES[kind]) for name, kind in get_type_hints(Problem).items()], align=True
)


def pack(robot: Robot, settings: Settings, by_structure: bool) -> NDArray[np.void]:
    """Return the record, (1,)."""
    values = vars(settings) | {
        "by_structure": by_structure,
        "size": tuple(robot.lengths.model_dump().values()),
        "lower": robot.lower,
        "upper": robot.upper,
        "by_residual": settings.local_search == "residual",
        "enough": settings.enough(of_residuals=True),
    }
    return np.array([tuple(values[name] for name in Problem._fields)], RECORD)
