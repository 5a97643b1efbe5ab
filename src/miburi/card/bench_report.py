"""The bench's findings about a card, in the file that builders send to the project."""

from pathlib import Path
from typing import NamedTuple

from pydantic import Field

from miburi.errors import BodyError
from miburi.ground.files import write_whole
from miburi.ground.tables import Table, load_table
from miburi.robot import Robot

Value = float | str | list[float] | list[str]


class BenchFindings(NamedTuple):
    """One measurement's result: figures for people, and constants for a servo's TOML tables."""

    measured: dict[str, Value]
    constants: dict[str, dict[str, float]]


class BenchReport(Table):
    """A report: what each step measured, and constants as a servo's TOML file has them."""

    robot: str
    servo: str
    measured: dict[str, dict[str, Value]] = Field(default_factory=dict)
    constants: dict[str, dict[str, float]] = Field(default_factory=dict)

    def after(self, step: str, found: BenchFindings) -> "BenchReport":
        """Return the report with the findings of a step."""
        constants = dict(self.constants)
        for table, values in found.constants.items():
            constants[table] = constants.get(table, {}) | values
        measured = self.measured | {step: found.measured}
        return self.model_copy(update={"measured": measured, "constants": constants})


def read_report(robot: Robot, path: Path) -> BenchReport:
    """Read this robot's report from a file, or return an empty report if there is no file.

    Raises
    ------
    DescriptionError
        The file is not a report.
    BodyError
        It is another robot's report.
    """
    new = BenchReport(robot=robot.name, servo=robot.servo.model.name)
    if not path.exists():
        return new
    old = load_table(BenchReport, path)
    if (old.robot, old.servo) != (new.robot, new.servo):
        raise BodyError(
            f"{path} is the report of another robot ({old.robot} with {old.servo}); name another "
            "file with --out."
        )
    return old


def write_report(report: BenchReport, path: Path) -> None:
    """Write a report as TOML, atomically."""
    lines = ["# Measured by `miburi card measure`; constants as in a servo's TOML file, SI units."]
    lines += [f'robot = "{report.robot}"', f'servo = "{report.servo}"']
    for part, tables in (("measured", report.measured), ("constants", report.constants)):
        for name, values in tables.items():
            lines += ["", f"[{part}.{name}]"]
            lines += [f"{key} = {_toml(value)}" for key, value in values.items()]
    write_whole(path, "\n".join(lines) + "\n")


def _toml(value: Value) -> str:
    if isinstance(value, list):
        return f"[{', '.join(_toml(one) for one in value)}]"
    return f'"{value}"' if isinstance(value, str) else f"{float(f'{value:.5g}')}"
