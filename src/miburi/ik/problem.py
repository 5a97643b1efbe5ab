"""The records that compiled code reads and writes: a body, and the state of one search.

Both are structured arrays with one row, because an array costs little to pass to Numba. With the
body as a NamedTuple, a call would take 2 µs more, and a whole solution takes only 2.6 µs. Numba
does not count references to a record's fields.
"""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from miburi.robot import Robot
from miburi.robot.description import Lengths
from miburi.robot.geometry import arm_reach

#: The largest coordinate of a target, in m: far below coordinates whose squares would overflow.
FARTHEST = 1e9
#: A target counts as reached if its residual is below this share of the arm's reach: 0.07 mm for
#: the iphonoid.
REACHED = 5e-4
#: The search ends at this residual, a share of the arm's reach: 0.14 µm for the iphonoid.
TOLERANCE = 1e-6


def _record(fields: list[tuple[Any, ...]]) -> np.dtype[np.void]:
    """Return a type whose rows have their fields as attributes, even without Numba's compiler."""
    return np.dtype((np.record, np.dtype(fields, align=True)))


#: The body's constants that the search uses.
BODY = _record(
    [
        ("lengths", _record([(name, np.float64) for name in Lengths.model_fields])),  # m
        ("lower", np.float64, 8),  # rad, Table 1
        ("upper", np.float64, 8),  # rad
        ("enough", np.float64),  # m², the value of Eq. 13 at which a search ends
        ("reached", np.float64),  # m, the residual at which a target counts as reached
    ]
)
#: The state of one search; the compiled functions write it.
WORK = _record(
    [
        ("target", np.float64, 9),  # m
        ("best", np.float64, 8),  # rad, the best pose so far
        ("value", np.float64),  # Eq. 13 there; infinity before any pose was evaluated
        ("evaluations", np.int64),  # how many poses were evaluated
        ("new", np.float64, 8),  # rad, the pose evaluated last
    ]
)
# Rows of the two records; compiled code reads their fields by name.
Body: TypeAlias = Any
Work: TypeAlias = Any


def pack(robot: Robot) -> NDArray[np.void]:
    """Return a robot as a record: an array with one row."""
    reach, size = arm_reach(robot), tuple(robot.lengths.model_dump().values())
    enough = (TOLERANCE * reach) ** 2
    return np.array([(size, robot.lower, robot.upper, enough, REACHED * reach)], BODY)
