"""A calibration on disk: period, ratio and guards of the contact rule for one robot's servos."""

from dataclasses import fields
from pathlib import Path
from typing import Annotated

from pydantic import Field

from miburi import contact
from miburi.contact import Rule
from miburi.motion import SECOND
from miburi.robot import Robot
from miburi.robot.description import Guards
from miburi.tables import Table, load_table


class RuleTable(Table):
    """Eqs. 1 and 2: the period in s, a whole number of 10 ms readings, and the ratio."""

    period: Annotated[float, Field(ge=0.02, le=1.0, multiple_of=0.01)]
    ratio: Annotated[float, Field(ge=0, le=1)]


class CalibrationFile(Table):
    """The file: ``guards`` are the table of the robot's description."""

    rule: RuleTable
    guards: Guards


def write_calibration(robot: Robot, rule: Rule, path: Path, note: str) -> None:
    """Write a rule's period, ratio and guards as TOML, in s and rad; ``note`` heads the file."""
    step = robot.servo.step
    lines = [f"# {line}" for line in note.splitlines()]
    lines += ["", "[rule]", f"period = {rule.period / SECOND:g} # s"]
    lines += [f"ratio = {rule.ratio / 10_000:g}", "", "[guards]"]
    for field in fields(contact.Guards):
        values = getattr(rule.guards, field.name)
        scaled = values / SECOND if field.name == "lag" else values * step
        unit = "s" if field.name == "lag" else "rad"
        lines.append(f"{field.name} = [{', '.join(f'{v:.6f}' for v in scaled)}] # {unit}")
    path.write_text("\n".join(lines) + "\n")


def read_calibration(robot: Robot, path: Path) -> tuple[Robot, Rule]:
    """Return the robot with the file's guards, and the rule.

    Raises
    ------
    DescriptionError
        The file cannot be read, or is not a calibration; the message says what is wrong.
    """
    found = load_table(CalibrationFile, path)
    robot = robot.model_copy(update={"guards": found.guards})
    guards = contact.Guards.of(robot)
    period = round(found.rule.period * SECOND)
    return robot, Rule(guards, period, round(found.rule.ratio * 10_000))
