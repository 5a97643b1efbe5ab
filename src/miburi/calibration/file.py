"""Read and write calibration files: the contact rule's period, ratio and guards for one robot.

A card's calibration also says how its servos are mounted. If the servos were identified, the file
holds their constants as multiples of the description's.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from miburi.errors import DescriptionError
from miburi.ground.tables import Table, load_table
from miburi.robot import Robot
from miburi.robot.description import GuardsTable
from miburi.robot.fit import checksums, differing
from miburi.robot.guards import GUARDS, check_ranges, in_whole_units
from miburi.safety.contact import Rule
from miburi.safety.profile import SECOND
from miburi.version import __version__

if TYPE_CHECKING:
    from miburi.calibration.shares import Shares
    from miburi.safety.free import FreeRule


class RuleTable(Table):
    """The rule's period in s and its ratio (Eqs. 1 and 2), within the ranges that a card accepts.

    The period is a multiple of 10 ms.
    """

    period: Annotated[float, Field(ge=0.02, le=0.2, multiple_of=0.01)]
    ratio: Annotated[float, Field(ge=0.8, le=1)]


_Eight = Field(min_length=8, max_length=8)


class Mounting(Table):
    """How a card's servos are mounted, in the order of the joints.

    Attributes
    ----------
    id
        Each servo's id on the bus.
    direction
        1 if joint and servo turn the same way, −1 if they turn opposite ways.
    zero
        The position of each servo at joint angle 0, in steps.
    """

    id: Annotated[list[Annotated[int, Field(ge=0, le=252)]], _Eight]
    direction: Annotated[list[Literal[1, -1]], _Eight]
    zero: Annotated[list[Annotated[int, Field(ge=0, le=4095)]], _Eight]

    @model_validator(mode="after")
    def _differ(self) -> "Mounting":
        if len(set(self.id)) < len(self.id):
            raise ValueError(f"each servo needs an id of its own, got {self.id}")
        return self


#: The constants of each servo, as multiples of the description's.
_SHARES = ("stiffness", "damping", "friction", "gravity")
_Shares = Annotated[list[Annotated[float, Field(gt=0, le=20)]], _Eight]


class IdentifiedTable(Table):
    """Identified servos: kind, P gain and divisor, and constants as multiples of the nominal ones.

    Attributes
    ----------
    servo
        The name of the servo whose constants the shares refer to.
    gain, divisor
        The P gain that was set, and the number by which the servo divides it.
    wear, stiffness, damping, friction, gravity
        As in :class:`miburi.calibration.shares.Shares`.
    """

    servo: str
    gain: Annotated[float, Field(gt=0)]
    divisor: Annotated[float, Field(gt=0)]
    wear: Annotated[float, Field(ge=1, le=3)]
    stiffness: _Shares
    damping: _Shares
    friction: _Shares
    gravity: _Shares


class FitsTable(Table):
    """Checksums of the description that was calibrated; see :mod:`miburi.robot.fit`."""

    lengths: str
    masses: str
    joints: str
    servo: str


class CalibrationFile(Table):
    """The content of a calibration file; ``guards`` is the same table as in a description.

    ``robot``, ``servo`` and ``fits`` say what was calibrated; earlier files do not.
    """

    robot: str | None = None
    servo: str | None = None
    fits: FitsTable | None = None
    rule: RuleTable
    guards: GuardsTable
    servos: Mounting | None = None
    identified: IdentifiedTable | None = None


@dataclass(frozen=True)
class Calibration:
    """A calibration as read from its file: the robot and its rules.

    Attributes
    ----------
    robot
        The robot, with its own servos where they were identified.
    rule
        The rule with the guards of this robot.
    servos
        How the servos are mounted; None if the calibration is not that of a card.
    identified
        The rule with a model of the measured servos; None if they were not measured.
    named
        Whether the file says which robot it is for, which was then found to be this one.
    """

    robot: Robot
    rule: "FreeRule"
    servos: Mounting | None
    identified: "FreeRule | None" = None
    named: bool = False


def write_calibration(
    robot: Robot,
    rule: Rule,
    path: Path,
    note: str,
    servos: Mounting | None = None,
    identified: "Shares | None" = None,
    of: Robot | None = None,
) -> None:
    """Write a calibration as TOML, in rad and s.

    ``note`` becomes a comment at the top, and Miburi's version the next line.

    ``of`` is the robot as it was described, if ``robot`` has the servos that were identified.
    """
    step = robot.servo.step
    lines = [f"# {line}".rstrip() for line in note.splitlines()]
    lines += [f"# Written by Miburi {__version__}."]
    lines += ["", f'robot = "{robot.name}"', f'servo = "{robot.servo.model.name}"']
    lines += ["", "[fits] # checksums of the description"]
    lines += [f'{part} = "{checksum}"' for part, checksum in checksums(of or robot).items()]
    lines += ["", "[rule]", f"period = {rule.period / SECOND:g} # s"]
    lines += [f"ratio = {rule.ratio / 10_000:g}", "", "[guards]"]
    for name, values in vars(rule.guards).items():
        unit = GUARDS[name].unit
        numbers = ", ".join(f"{value:.6f}" for value in values * unit.size(step))
        lines.append(f"{name} = [{numbers}] # {unit.si}")
    if servos is not None:
        lines += ["", "[servos]"]
        lines += [f"{name} = {values}" for name, values in servos.model_dump().items()]
    if identified is not None:
        servo = robot.servo.model
        lines += ["", "[identified]", f'servo = "{servo.name}"']
        lines += [f"gain = {servo.drive.gain:g}", f"divisor = {servo.divisor.p_divisor!r}"]
        lines.append(f"wear = {float(identified.wear)!r} # times the servo's friction")
        for name in _SHARES:
            # All digits are written, so that the card's integers come out the same.
            lines.append(f"{name} = {vars(identified)[name].tolist()} # times the description's")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def read_calibration(robot: Robot, path: Path) -> Calibration:
    """Read a calibration of ``robot``; angles are rounded to the steps of its servo.

    Raises
    ------
    DescriptionError
        The file cannot be read, or it is not a calibration of this robot.
    """
    from miburi.calibration.identify import expecting  # it loads Numba
    from miburi.calibration.shares import Shares
    from miburi.safety.free import FreeRule

    table = load_table(CalibrationFile, path)
    _check_fit(robot, table, path)
    period, ratio = round(table.rule.period * SECOND), round(table.rule.ratio * 10_000)
    try:
        check_ranges(table.guards)
    except ValueError as error:
        raise DescriptionError(f"{path}: {error}.") from None
    guards = in_whole_units(table.guards, robot.servo.step)
    own, rule = table.identified, FreeRule.of(robot)
    if own is not None:
        robot = _with_identified(robot, own)
        values = {name: np.array(vars(own)[name]) for name in _SHARES}
        rule = expecting(robot, Shares(**values, wear=own.wear), guards)
    rule = replace(rule, guards=guards, period=period, ratio=ratio)
    identified = rule if own is not None else None
    return Calibration(robot, rule, table.servos, identified, named=table.fits is not None)


def _check_fit(robot: Robot, table: CalibrationFile, path: Path) -> None:
    if table.robot not in (None, robot.name):
        raise DescriptionError(
            f"{path} is for the robot {table.robot}, and this one is {robot.name}; give the file "
            "of that robot with --robot, or calibrate this one."
        )
    own = robot.servo.model.name
    for servo in (table.servo, table.identified and table.identified.servo):
        if servo not in (None, own):
            raise DescriptionError(
                f"{path} is for the servo {servo}, but the robot has {own}; choose that servo "
                "with --servo, or calibrate this one."
            )
    if table.fits and (what := differing(table.fits.model_dump(), checksums(robot))):
        raise DescriptionError(
            f"{path} was measured on a robot with other {what}; give its file with --robot, or "
            "calibrate this one."
        )


def _with_identified(robot: Robot, table: IdentifiedTable) -> Robot:
    servo = robot.servo.model.varied(friction=table.wear)
    drive = servo.drive.model_copy(update={"gain": table.gain})
    divisor = servo.divisor.model_copy(update={"p_divisor": table.divisor})
    return robot.with_servo(servo.model_copy(update={"drive": drive, "divisor": divisor}))
