"""Options that several commands share, and functions that read their files."""

import os
import shlex
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from miburi.errors import InputError

if TYPE_CHECKING:
    from miburi.bma.settings import Settings
    from miburi.feelings import FeelingModel, Temperament
    from miburi.gestures import MovementFunction, Repertoire
    from miburi.robot import Robot
    from miburi.safety.free import FreeRule


AsJson = Annotated[bool, typer.Option("--json", help="Print JSON, one line for each result.")]
RobotFile = Annotated[
    Path | None,
    typer.Option("--robot", help="A robot description; default: the iPhonoid."),
]
GesturesFolder = Annotated[
    Path | None,
    typer.Option(
        "--gestures",
        help="A folder of gesture files; they replace shipped ones for the same feelings.",
    ),
]


def _choose_senses(path: Path | None) -> Path | None:
    if path is not None:
        os.environ["MIBURI_SENSES"] = str(path.resolve())  # also for the processes that it starts
        from miburi.senses.happenings import happenings

        happenings.cache_clear()
        happenings()  # refuses a wrong file now, before anything else
    return path


SensesFile = Annotated[
    Path | None,
    typer.Option(
        "--senses",
        help="A file of events that your programs report, and the feelings that they cause.",
        envvar="MIBURI_SENSES",
        callback=_choose_senses,
    ),
]


def _choose_languages(path: Path | None) -> Path | None:
    if path is not None:
        from miburi.languages import VARIABLE, folders
        from miburi.studio.words import page_languages, untranslated, words
        from miburi.talk.own_languages import check_languages

        os.environ[VARIABLE] = str(path.resolve())  # also for the processes that it starts
        folders.cache_clear()
        for warning in check_languages(path):
            typer.echo(f"miburi: {warning}", err=True)
        for language in page_languages():
            words(language)  # raises an error if a page could not be shown in it
            if (path / language).is_dir() and (english := untranslated(language)):
                file = path / language / "pages.toml"
                typer.echo(f"miburi: {file}: {english} texts are still in English.", err=True)
    return path


LanguagesFolder = Annotated[
    Path | None,
    typer.Option(
        "--languages",
        help="A folder of languages that the partner hears and speaks besides its own.",
        envvar="MIBURI_LANGUAGES",
        callback=_choose_languages,
    ),
]
BrokerCertificates = Annotated[
    Path | None,
    typer.Option(
        "--broker-ca", help="A file of certificates to trust (PEM); default: the system's."
    ),
]
CalibrationFile = Annotated[
    Path | None,
    typer.Option("--calibration", help="A file from miburi calibrate or tune."),
]
IkWay = Annotated[
    str,
    typer.Option(
        "--ik",
        help="The solver: 'default'; 'residual', a general search that only uses errors and their "
        "slopes; or 'paper', with the parameters of Table 2. The last two draw from a fixed seed: "
        "the same target and start give the same answer.",
    ),
]
ServoName = Annotated[
    str | None,
    typer.Option(
        "--servo",
        help="'xl330-m288-t', 'imagined' (a made-up servo), or a file (….toml); by default, the "
        "robot's own servo.",
    ),
]
EmotionalModelName = Annotated[str, typer.Option("--emotional-model", help="cascade or spiking.")]
TemperamentName = Annotated[
    str, typer.Option("--temperament", help="default, calm, lively, playful, or a file (….toml).")
]


#: Options on which no result depends.
_NO_CONDITION = {"out", "film", "face", "as_json", "workers", "ray"}


def command_line(context: typer.Context) -> str:
    """Return a command with all options that its results depend on, also those not given.

    Files are named without their folders, so that the same run gives the same words anywhere.
    """
    return shlex.join(_words(context))


def _words(context: Any) -> list[str]:
    words = [*_words(context.parent), context.info_name] if context.parent else ["miburi"]
    for param in context.command.params:
        value = context.params.get(param.name)
        if value is None or param.name in _NO_CONDITION:
            continue
        if isinstance(value, bool):
            words += (param.opts if value else param.secondary_opts)[:1]
        else:
            is_file = isinstance(value, Path) or str(value).endswith(".toml")
            words += [param.opts[0], Path(value).name if is_file else str(value)]
    return words


def robot_of(file: Path | None, servo: str | None = None) -> "Robot":
    """Return the robot in a file, by default the iphonoid, with another ``servo`` if given."""
    from miburi.robot import iphonoid, load_robot
    from miburi.servos import load_servo

    if file is not None and file.suffix != ".toml" and not os.path.exists(file):  # noqa: PTH110
        raise InputError(
            f"--robot: there is no file {file}; `miburi template robot NAME > mine.toml` writes "
            "the description of a shipped robot."
        )
    robot = iphonoid() if file is None else load_robot(file)
    if servo is not None:
        robot = robot.with_servo(load_servo(servo))
        robot.servo.check_hold()
    return robot


def must_be_one_of(allowed: Iterable[str], given: str, what: str) -> None:
    """Raise InputError if ``given`` is not allowed; the message lists the allowed values."""
    if given not in (names := list(allowed)):
        raise InputError(f"{what} must be one of {', '.join(names)}, got {given!r}.")


def warn_of_foreign_guards(robot: "Robot") -> bool:
    """Warn if a robot has a shipped robot's guards (tolerances), but other servos or limbs.

    Like the warnings below, return whether there was a reason.
    """
    from miburi.robot import buildable, iphonoid
    from miburi.robot.fit import checksums, differing

    for shipped in (iphonoid(), buildable()):
        measured, own = shipped.servo.model.name, robot.servo.model.name
        if robot.guards != shipped.guards:
            continue
        if own != measured:
            whose = f"{measured} servos, and this robot has {own}"
        elif what := differing(checksums(robot), checksums(shipped)):
            whose = f"the {what} of {shipped.name}, and this robot has others"
        else:
            continue
        print(
            f"miburi: the guards of the contact rule are for {whose}: "
            "it may press harder on contact, or stop without any contact. Let "
            "`miburi calibrate` measure your own, and give its file with --calibration.",
            file=sys.stderr,
        )
        return True
    return False


def calibrated(robot: "Robot", file: Path | None) -> tuple["Robot", "FreeRule | None"]:
    """Return the robot and the contact rule in a calibration file.

    Without a file, the robot is unchanged, and the rule is None: the robot's own rule applies.
    """
    from miburi.calibration.file import read_calibration

    if file is None:
        warn_of_foreign_guards(robot)
        return robot, None
    found = read_calibration(robot, file)
    return found.robot, found.rule


def settings_of(robot: "Robot", way: str) -> "Settings | None":
    """Return the settings for one way to solve inverse kinematics; see :func:`miburi.ik.solve`."""
    from miburi.bma.settings import Settings
    from miburi.ik import residual_settings

    ways = {
        "default": lambda: None,
        "residual": lambda: residual_settings(robot),
        "paper": Settings.paper,
    }
    must_be_one_of(ways, way, "--ik")
    return ways[way]()


def emotional_model_of(name: str) -> "type[FeelingModel]":
    """Return an emotional model by its name."""
    from miburi.feelings import MODELS

    must_be_one_of(MODELS, name, "the emotional model")
    return MODELS[name]


def temperament_of(source: str) -> "Temperament":
    """Return a shipped temperament by its name, or the temperament in a file."""
    from miburi.feelings import load_temperament, shipped_temperament

    return load_temperament(source) if source.endswith(".toml") else shipped_temperament(source)


def gesture_of(robot: "Robot", source: str) -> "MovementFunction":
    """Return the shipped gesture of a feeling, or the gesture in a file."""
    from miburi.gestures import load, load_for

    if source.endswith(".toml"):
        return load_for(robot, source)
    function = load(source)
    warn_of_misfits(robot, [function])
    return function


def repertoire_of(robot: "Robot", folder: Path | None) -> "Repertoire":
    """Return the shipped gestures; a folder's gestures replace those for the same feelings."""
    repertoire = load_gestures(robot, folder)
    warn_of_misfits(robot, repertoire.functions)
    return repertoire


def load_gestures(robot: "Robot", folder: Path | None) -> "Repertoire":
    """Return the same as :func:`repertoire_of`, without the warning, which needs the solver."""
    from miburi.gestures import read_repertoire, shipped_repertoire

    return shipped_repertoire() if folder is None else read_repertoire(folder, robot)


def warn_of_misfits(robot: "Robot", functions: Iterable["MovementFunction"]) -> bool:
    """Warn about shipped gestures that the robot cannot do as written."""
    from miburi.gestures import misfits

    near = [function.name for function in functions if any(misfits(robot, function))]
    if near:
        print(
            f"miburi: {robot.name} cannot reach every pose of these gestures and goes as near as "
            f"it can: {', '.join(near)}. Gestures of your own (--gestures) replace them.",
            file=sys.stderr,
        )
    return bool(near)


def warn_of_meetings(
    robot: "Robot", functions: Iterable["MovementFunction"], *, by_rule: bool = False
) -> bool:
    """Warn about gestures in which parts of the robot meet at mood 1; it takes 0.1 s for each.

    With ``by_rule``, also warn about gestures that the contact rule stops, with the robot's guards.
    """
    from miburi.bodies.rehearsal import rehearse
    from miburi.errors import DescriptionError
    from miburi.gestures import key_poses

    try:
        shown = {one.name: rehearse(robot, key_poses(robot, one, 1.0)) for one in functions}
    except DescriptionError as error:  # parts meet even at neutral
        print(f"miburi: {error}", file=sys.stderr)
        return True
    met = [f"{name} ({' and '.join(done.met)})" for name, done in shown.items() if done.met]
    if met:
        print(
            f"miburi: parts of {robot.name} meet in these gestures, at mood 1: {', '.join(met)}. "
            "Gestures of your own (--gestures) replace them; `miburi gesture check` says more.",
            file=sys.stderr,
        )
    stopped = [name for name, done in shown.items() if by_rule and done.stop and not done.met]
    if stopped:
        print(
            f"miburi: the contact rule stops these gestures, though nothing touches {robot.name}: "
            f"{', '.join(stopped)}. Guards of its own (`miburi calibrate`), or lighter or shorter "
            "arms, help.",
            file=sys.stderr,
        )
    return bool(met or stopped)
