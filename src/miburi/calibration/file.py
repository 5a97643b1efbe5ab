"""A calibration on disk: period, ratio and guards of the contact rule for one robot's servos.

A card's calibration also says how its servos are mounted; all others leave that out.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from miburi.ground.tables import Table, load_table
from miburi.robot import Robot
from miburi.robot.description import GuardsTable
from miburi.robot.guards import GUARDS, in_whole_units
from miburi.safety.contact import Rule
from miburi.safety.profile import SECOND

__all__ = [
    "Calibration",
    "CalibrationFile",
    "Mounting",
    "RuleTable",
    "read_calibration",
    "write_calibration",
]


class RuleTable(Table):
    """Eqs. 1 and 2: the period in s, a whole number of 10 ms readings, and the ratio."""

    period: Annotated[float, Field(ge=0.02, le=1.0, multiple_of=0.01)]
    ratio: Annotated[float, Field(ge=0, le=1)]


_Eight = Field(min_length=8, max_length=8)


class Mounting(Table):
    """How a card's servos are mounted, in the order of the joints.

    Attributes
    ----------
    id
        Each servo's number on the bus.
    direction
        The sign of the joint's angle against the servo's: 1 or −1.
    zero
        The servo's position at joint angle 0, in its steps.
    """

    id: Annotated[list[Annotated[int, Field(ge=0, le=252)]], _Eight]
    direction: Annotated[list[Literal[1, -1]], _Eight]
    zero: Annotated[list[Annotated[int, Field(ge=0, le=4095)]], _Eight]

    @model_validator(mode="after")
    def _differ(self) -> "Mounting":
        if len(set(self.id)) < len(self.id):
            raise ValueError(f"each servo needs an id of its own, got {self.id}")
        return self


class CalibrationFile(Table):
    """The file: ``guards`` are the table of the robot's description."""

    rule: RuleTable
    guards: GuardsTable
    servos: Mounting | None = None


@dataclass(frozen=True)
class Calibration:
    """What a file says: the robot with its guards, the rule, and a card's mounting if any."""

    robot: Robot
    rule: Rule
    servos: Mounting | None


def write_calibration(
    robot: Robot, rule: Rule, path: Path, note: str, servos: Mounting | None = None
) -> None:
    """Write a calibration as TOML, angles in rad and times in s; ``note`` heads the file."""
    step = robot.servo.step
    lines = [f"# {line}".rstrip() for line in note.splitlines()]
    lines += ["", "[rule]", f"period = {rule.period / SECOND:g} # s"]
    lines += [f"ratio = {rule.ratio / 10_000:g}", "", "[guards]"]
    for name, values in vars(rule.guards).items():
        unit = GUARDS[name].unit
        shown = ", ".join(f"{value:.6f}" for value in values * unit.size(step))
        lines.append(f"{name} = [{shown}] # {unit.si}")
    if servos is not None:
        lines += ["", "[servos]"]
        lines += [f"{name} = {values}" for name, values in servos.model_dump().items()]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def read_calibration(robot: Robot, path: Path) -> Calibration:
    """Read a calibration of ``robot``; angles are rounded to its servo's steps.

    Raises
    ------
    DescriptionError
        The file cannot be read, or is not a calibration; the message says what is wrong.
    """
    found = load_table(CalibrationFile, path)
    robot = robot.model_copy(update={"guards": found.guards})
    period, ratio = round(found.rule.period * SECOND), round(found.rule.ratio * 10_000)
    guards = in_whole_units(found.guards, robot.servo.step)
    return Calibration(robot, Rule(guards, period, ratio), found.servos)
