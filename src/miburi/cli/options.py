"""The options that several commands share, and what becomes of the files that they name."""

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from miburi.feelings import Temperament
    from miburi.gestures import MovementFunction, Repertoire
    from miburi.robot import Robot
    from miburi.safety.contact import Rule

__all__ = [
    "CalibrationFile",
    "GesturesFolder",
    "RobotFile",
    "TemperamentName",
    "gesture_of",
    "repertoire_of",
    "robot_of",
    "rule_of",
    "temperament_of",
]

RobotFile = Annotated[
    Path | None,
    typer.Option("--robot", help="A robot description; default: the iphonoid.", show_default=False),
]
GesturesFolder = Annotated[
    Path | None,
    typer.Option(
        "--gestures",
        help="A folder of gesture files; they replace those of the same feelings.",
        show_default=False,
    ),
]
CalibrationFile = Annotated[
    Path | None,
    typer.Option("--calibration", help="A file of miburi calibrate or tune.", show_default=False),
]
TemperamentName = Annotated[
    str, typer.Option("--temperament", help="default, calm, lively, playful, or a file (….toml).")
]


def robot_of(file: Path | None) -> "Robot":
    """Read the robot that a command is for."""
    from miburi.robot import iphonoid, load_robot

    return iphonoid() if file is None else load_robot(file)


def rule_of(robot: "Robot", file: Path | None) -> "Rule | None":
    """Read the contact rule of a calibration, if one is given."""
    from miburi.calibration.file import read_calibration

    return None if file is None else read_calibration(robot, file).rule


def temperament_of(source: str) -> "Temperament":
    """Read a temperament that ships with Miburi, or one's own."""
    from miburi.feelings import load_temperament, shipped_temperament

    return load_temperament(source) if source.endswith(".toml") else shipped_temperament(source)


def gesture_of(robot: "Robot", source: str) -> "MovementFunction":
    """Read the gesture that ships for a feeling, or one's own."""
    from miburi.gestures import load, load_for

    if source.endswith(".toml"):
        return load_for(robot, source)
    function = load(source)
    _warn_of_bent(robot, [function])
    return function


def repertoire_of(robot: "Robot", folder: Path | None) -> "Repertoire":
    """Read the gestures that a command is for."""
    from miburi.gestures import read_repertoire, shipped

    repertoire = shipped() if folder is None else read_repertoire(folder, robot)
    _warn_of_bent(robot, repertoire.functions)
    return repertoire


def _warn_of_bent(robot: "Robot", functions: Iterable["MovementFunction"]) -> None:
    """Name the gestures that ship with Miburi and that the robot cannot do as written."""
    from miburi.gestures import misfits

    bent = [function.name for function in functions if any(misfits(robot, function))]
    if bent:
        print(
            f"miburi: gestures that {robot.name} cannot do as written are bent to what its joint "
            f"limits allow: {', '.join(bent)}. Gestures of your own (--gestures) replace them.",
            file=sys.stderr,
        )
