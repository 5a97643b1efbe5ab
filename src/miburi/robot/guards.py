"""The guards of the contact rule: each stands here once, as a field of :class:`Guards`.

A guard is what the rule grants a motor beyond the paper's ratio, because no servo follows its
command exactly. The robot's description, the rule, the card's settings, the calibration file and
the wire take the guards' names, order, units and ranges from here.

A new guard is a row here, its use in ``contact.py`` and ``calibration.py``, its twin in the
firmware (``contact.h``, ``settings.h``: a test compares them with the rows), and its eight values
in a robot's TOML.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Annotated, Any, Generic, NamedTuple, TypeVar, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, GetJsonSchemaHandler, with_config
from pydantic_core import CoreSchema

__all__ = ["ANGLE", "GUARDS", "TIME", "Guard", "Guards", "Unit", "by_motor", "in_whole_units"]

Value = TypeVar("Value")
Other = TypeVar("Other")
_Integers = NDArray[np.int64]


class Unit(NamedTuple):
    """SI in files and on the wire; whole in the rule and on the card, with the ``struct`` code."""

    si: str
    whole: str
    code: str

    def size(self, step: float) -> float:
        """Return one whole unit in SI; ``step`` is the angle of an encoder step, rad."""
        return step if self.whole == "steps" else 1e-6


TIME, ANGLE = Unit("s", "µs", "i"), Unit("rad", "steps", "h")


@dataclass(frozen=True)
class Guard:
    """One row; all numbers are ours.

    Attributes
    ----------
    grants
        What it grants, in words.
    low, high
        The range that the card takes, in whole units.
    generous
        What the card grants while its servos are not known, in whole units: all these together
        let any lag up to 50 ms pass.
    floor
        The least that a calibration grants, rad, as few moves do not show all that a servo
        needs; 0 for a guard that is not measured as a need of free motion.
    """

    grants: str
    unit: Unit
    low: int
    high: int
    generous: int
    floor: float = 0.0

    def __get_pydantic_json_schema__(
        self, core: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Describe the guard in the interface's schema."""
        return {**handler(core), "description": f"{self.grants}, {self.unit.si}."}


@with_config(ConfigDict(extra="forbid", allow_inf_nan=False))
@dataclass(frozen=True)
class Guards(Generic[Value]):
    """A value for each guard, in the card's order; ``miburi.safety.contact`` says what it does.

    ``Guards[Steps]`` is what the rule grants the eight motors, (8,) µs or steps each; a motor's
    own guards are ``Guards[int]`` on the card and ``Guards[float]``, in SI units, on the wire.
    """

    lag: Annotated[Value, Guard("Delay behind its profile", TIME, 0, 100_000, 30_000)]
    slack: Annotated[Value, Guard("Travel that may always be missing", ANGLE, 0, 40, 40, 0.006)]
    least: Annotated[Value, Guard("Less expected travel is judged later", ANGLE, 1, 100, 16)]
    behind: Annotated[Value, Guard("Farthest behind its profile", ANGLE, 1, 300, 150, 0.0092)]
    ahead: Annotated[Value, Guard("Farthest ahead of its profile", ANGLE, 1, 300, 150, 0.0092)]
    arrival: Annotated[Value, Guard("Farthest from its goal at last", ANGLE, 1, 150, 60, 0.0092)]

    def map(self, change: Callable[[Guard, Value], Other]) -> "Guards[Other]":
        """Return what ``change`` makes of each row and its value."""
        return Guards(*map(change, GUARDS.values(), vars(self).values()))


#: The rows by their names, in the card's order.
GUARDS: dict[str, Guard] = {field.name: get_args(field.type)[1] for field in fields(Guards)}


def in_whole_units(guards: Guards[list[float]], step: float) -> Guards[_Integers]:
    """Return guards in SI units as the rule counts them; ``step`` is an encoder step, rad."""
    return guards.map(
        lambda guard, values: np.rint(np.divide(values, guard.unit.size(step))).astype(np.int64)
    )


def by_motor(guards: Guards[_Integers]) -> list[Guards[int]]:
    """Return each motor's own guards."""
    return [Guards(*own) for own in np.transpose(list(vars(guards).values())).tolist()]
