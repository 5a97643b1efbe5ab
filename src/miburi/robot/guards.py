"""The guards of the contact rule: names, order, units and ranges, all in one table.

No servo follows its command exactly. A guard is a tolerance of the contact rule, beyond the ratio
that the paper gives (see :mod:`miburi.safety.contact`). The robot's description, the rule, a card's
settings, the calibration file and the link's messages all derive their guards from :class:`Guards`.

To add a guard, add a field to :class:`Guards`, use it in ``safety/contact.py`` and
``calibration/free_motion.py``, add it to the firmware (``contact.h`` and ``settings.h``; a test
compares them with this table), and give its eight values in the robots' TOML files.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Annotated, Any, Generic, NamedTuple, TypeVar, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, GetJsonSchemaHandler, with_config
from pydantic_core import CoreSchema

Value = TypeVar("Value")
Other = TypeVar("Other")
_Integers = NDArray[np.int64]
#: One encoder step of the XL330 servos on a card, in rad. The guards' ranges are given in these
#: steps, whatever encoder a servo has.
CARD_STEP = 2 * np.pi / 4096


class Unit(NamedTuple):
    """A unit: its SI name for files and wire, its integer unit for rule and card, and its code.

    The code is the format character for :mod:`struct`.
    """

    si: str
    whole: str
    code: str

    def size(self, step: float) -> float:
        """Return the integer unit in SI units; ``step`` is the angle of an encoder step, in rad."""
        return step if self.whole == "steps" else 1e-6


TIME, ANGLE = Unit("s", "µs", "i"), Unit("rad", "steps", "h")


@dataclass(frozen=True)
class Guard:
    """One guard's meaning and ranges; all numbers are ours.

    Attributes
    ----------
    grants
        What the guard allows, in words.
    unit
        Its unit.
    low, high
        The range that descriptions, calibrations and the card may give, in whole units.
    generous
        The value for a card whose servos have not been measured, in whole units. All generous
        values together let a lag of up to 50 ms pass.
    floor
        Calibration gives no value below this, in rad, because a few moves may not show a servo's
        largest deviation; 0 if the guard is not measured in free moves.
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
    """A value for each guard, in the card's order.

    ``Guards[Steps]`` holds the guards of all eight motors for the rule, (8,) µs or steps each. One
    motor's guards are ``Guards[int]`` on the card and ``Guards[float]``, in SI units, on the wire.
    """

    lag: Annotated[Value, Guard("Delay behind its profile", TIME, 0, 100_000, 5_500)]
    slack: Annotated[Value, Guard("How much travel may be missing", ANGLE, 0, 40, 40, 0.006)]
    least: Annotated[Value, Guard("Expected travel below which the test waits", ANGLE, 1, 100, 16)]
    behind: Annotated[
        Value, Guard("How far a motor may lag behind its profile", ANGLE, 1, 300, 150, 0.0092)
    ]
    ahead: Annotated[
        Value, Guard("How far it may be ahead of its profile", ANGLE, 1, 300, 150, 0.0092)
    ]
    arrival: Annotated[Value, Guard("How far from its goal it may end", ANGLE, 1, 150, 60, 0.0092)]

    def map(self, change: Callable[[Guard, Value], Other]) -> "Guards[Other]":
        """Return these guards with each value replaced by ``change(guard, value)``."""
        return Guards(*map(change, GUARDS.values(), vars(self).values()))


#: All guards by name, in the card's order.
GUARDS: dict[str, Guard] = {field.name: get_args(field.type)[1] for field in fields(Guards)}


def in_whole_units(guards: Guards[list[float]], step: float) -> Guards[_Integers]:
    """Convert guards from SI units to the rule's integers; ``step`` is one encoder step, in rad."""
    return guards.map(
        lambda guard, values: np.rint(np.divide(values, guard.unit.size(step))).astype(np.int64)
    )


def check_ranges(guards: Guards[list[float]]) -> None:
    """Check the guards of a file against their ranges, in steps of the card's servos.

    Raises
    ------
    ValueError
        A guard is out of its range: so narrow that it would stop free motion, or so wide that it
        guards nothing. The message says which guard, its value and what is allowed.
    """
    whole = in_whole_units(guards, CARD_STEP)
    for name, guard in GUARDS.items():
        for value, steps in zip(vars(guards)[name], vars(whole)[name].tolist(), strict=True):
            if not guard.low <= steps <= guard.high:
                low, high = (end * guard.unit.size(CARD_STEP) for end in (guard.low, guard.high))
                raise ValueError(
                    f"guards.{name} is {value:g} {guard.unit.si}; {low:.4g} to {high:.4g} "
                    f"{guard.unit.si} are allowed ({guard.low} to {guard.high} {guard.unit.whole})"
                )


def by_motor(guards: Guards[_Integers]) -> list[Guards[int]]:
    """Return the guards of each motor."""
    return [Guards(*own) for own in np.transpose(list(vars(guards).values())).tolist()]
