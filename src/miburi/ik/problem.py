"""What the compiled search reads and writes, as two records: the problem and the work.

Python packs a problem once for each robot and settings (:func:`pack`); the compiled functions
read its fields by name. Each search has a work of its own (``WORK``), for the target, the best
pose so far, and the memory of its steps. Both are structured arrays with one row. Numba takes an
array at little cost: a call with the problem as a NamedTuple takes 2 µs more, half a solution.
And it counts no references to a record's fields, which would be a third of a local search.
"""

from typing import Annotated, Any, NamedTuple, get_type_hints

import numpy as np
from numpy.typing import NDArray

from miburi.bma.settings import Settings
from miburi.robot import Array, Robot
from miburi.robot.description import Lengths

__all__ = ["FARTHEST", "RECORD", "WORK", "Problem", "Work", "pack"]

#: No coordinate of a target may be larger, in m: its square must stay a number.
FARTHEST = 1e9

Three = Annotated[Array, 3]
Eight = Annotated[Array, 8]
Nine = Annotated[Array, 9]
Square = Annotated[Array, (8, 8)]


class Problem(NamedTuple):
    """The record's fields: the body, and :class:`miburi.bma.Settings` by the same names."""

    size: Lengths
    lower: Eight  # rad, Table 1
    upper: Eight  # rad
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


class Work:
    """The record's fields: what one search works with. The compiled functions write them."""

    target: Nine  # m
    best: Eight  # rad, the best pose so far
    value: float  # Eq. 13 there; infinity where no pose was evaluated yet
    evaluations: int  # how many poses were
    # the pose evaluated last: what a change of one joint leaves as it is
    sines: Eight  # of the angles
    cosines: Eight
    errors: Three  # m², the squared errors of right hand, left hand and head
    # its neighbourhood, and the step of a local search
    normal: Square  # JᵀJ, its lower triangle; 0 where no joint of one limb meets one of another
    gradient: Eight  # of Eq. 13, 2 Jᵀe
    free: Eight  # 1, or 0 for a joint that the gradient presses on its limit
    step: Eight  # rad
    new: Eight  # rad, the pose that is tried


def _dtype(kind: Any) -> Any:
    if kind is Lengths:
        return np.dtype([(name, np.float64) for name in Lengths.model_fields])
    return (np.float64, kind.__metadata__[0]) if hasattr(kind, "__metadata__") else kind


def _record(fields: type) -> np.dtype[np.void]:
    hints = get_type_hints(fields, include_extras=True)
    return np.dtype([(name, _dtype(kind)) for name, kind in hints.items()], align=True)


RECORD, WORK = _record(Problem), _record(Work)


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
