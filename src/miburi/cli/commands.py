"""The command ``miburi``: parse the arguments, call the library, print the result."""

import io
import json
import os
import re
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from importlib import import_module
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Annotated, Any

import typer

from miburi.cli.agents import mcp
from miburi.cli.card import app as card_app
from miburi.cli.devices import devices_app
from miburi.cli.fleet import fleet
from miburi.cli.gestures import gallery, gesture_app
from miburi.cli.hardware import hardware_app
from miburi.cli.live import feel, status, stop
from miburi.cli.options import (
    AsJson,
    CalibrationFile,
    GesturesFolder,
    IkWay,
    RobotFile,
    ServoName,
    TemperamentName,
    calibrated,
    repertoire_of,
    robot_of,
    settings_of,
    temperament_of,
)
from miburi.cli.places import a_folder, check_folder
from miburi.cli.run import run
from miburi.cli.senses import listen, say, words
from miburi.cli.study import study_app
from miburi.cli.templates import template
from miburi.cli.to_ros import to_ros
from miburi.cli.trials import calibrate, safety_page, trials, tune
from miburi.cli.wrong import Explaining
from miburi.errors import InputError, MiburiError, need
from miburi.ground.log import log_to_stderr
from miburi.version import __version__

if TYPE_CHECKING:
    from miburi.bodies import Body
    from miburi.robot import Robot

__all__ = [
    "AsJson",
    "Point",
    "app",
    "common",
    "day",
    "experiment",
    "export",
    "feelings_app",
    "forward",
    "ik",
    "main",
    "paper",
]

app = typer.Typer(
    cls=Explaining,
    help="Feelings that show in a small robot's whole body, and a body that is safe to touch.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)
_NEGATIVE_NUMBERS = {"ignore_unknown_options": True}
#: The groups of commands, in the order of their help.
_LIVE, _MAKE, _MEASURE = "Live with it", "Make it yours", "Measure"
_BUILD, _DOCUMENTS = "Build and calibrate", "For Miburi's own documents"

#: How far a hand or the head may be from its place, m (ours).
_MISSED = 1e-3

Point = tuple[float, float, float]
#: Time until a lost interruption is sent again, s (ours).
_LATER = 0.02


class _Interrupted(BaseException):
    """Ctrl-C or SIGTERM; no handler of errors catches it, so only clean-up code runs."""

    #: The latest signal, if there was one.
    signum: int | None = None


def main() -> None:
    """Run the command line; an error becomes one clear line and an exit code."""
    signal.signal(signal.SIGINT, _interrupt)
    signal.signal(signal.SIGTERM, _interrupt)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # A pipe on Windows cannot encode arrows or a mu; its reader gets each line at once.
            stream.reconfigure(errors="replace", line_buffering=True)
    try:
        log_to_stderr()
        app()
    except InputError as error:
        sys.exit(_report(error, 2))
    except MiburiError as error:
        sys.exit(_report(error, 1))
    except BaseException as error:
        # Code interrupted halfway, such as a compiler, may raise an error of its own.
        if _Interrupted.signum is None or isinstance(error, SystemExit):
            raise
        print("miburi: interrupted.", file=sys.stderr)
        sys.exit(128 + _Interrupted.signum)
    finally:
        # Nothing catches an exception from now on; a second signal just ends the process.
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_DFL)


def _interrupt(signum: int, frame: FrameType | None) -> None:
    _Interrupted.signum = signum
    sys.unraisablehook = _after_an_interruption
    while frame is not None:
        if frame.f_code.co_name in ("__del__", _after_an_interruption.__name__):
            _interrupt_later(signum)  # an exception raised there would be lost
            return
        frame = frame.f_back
    raise _Interrupted


def _after_an_interruption(lost: "sys.UnraisableHookArgs") -> None:
    """Keep quiet about objects left half-made; send the signal again if its exception was lost.

    Numba's compiler calls Python from C, where an exception cannot propagate.
    """
    if lost.exc_type is _Interrupted and _Interrupted.signum is not None:
        _interrupt_later(_Interrupted.signum)


def _interrupt_later(signum: int) -> None:
    again = threading.Timer(_LATER, signal.raise_signal, [signum])
    again.daemon = True
    again.start()


def _report(error: MiburiError, code: int) -> int:
    """Print an error and return the exit code."""
    print(f"miburi: {error}", file=sys.stderr)
    return code


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"miburi {__version__}")
        raise typer.Exit


def _choose_feelings(path: Path | None) -> None:
    if path is not None:
        # Processes that this one starts inherit the variable.
        os.environ["MIBURI_FEELINGS"] = str(path.resolve())
        import_module("miburi.feelings")  # refuses a wrong file now, before anything else


@app.callback()
def common(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version."
        ),
    ] = False,
    feelings: Annotated[
        Path | None,
        typer.Option(
            help="A file of feelings; default: the paper's eight.",
            envvar="MIBURI_FEELINGS",
            callback=_choose_feelings,
            show_default=False,
        ),
    ] = None,
) -> None:
    """Miburi (身振り): gesture."""


def experiment(
    seed: Annotated[int, typer.Option(help="0 or more; the same seed gives the same run.")] = 1,
    seconds: Annotated[float, typer.Option(help="Length in the robot's time.")] = 30.0,
    feeling: Annotated[str, typer.Option(help="The emotion that is held.")] = "happiness",
    mood: Annotated[float, typer.Option(help="Its mood at the start, 0 to 1.")] = 0.9,
    period: Annotated[float, typer.Option(help="Seconds from gesture to gesture.")] = 2.0,
    heal: Annotated[
        bool,
        typer.Option(
            "--heal",
            help="After the gestures let the mood heal, compared with a twin that nobody touched.",
        ),
    ] = False,
    temperament: TemperamentName = "default",
    out: Annotated[Path, typer.Option(help="Folder for the results.", callback=a_folder)] = Path(
        "out/experiment"
    ),
    film: Annotated[bool, typer.Option(help="Draw the film (the longest part).")] = True,
    hand: Annotated[bool, typer.Option(help="A hand gets in the way now and then.")] = True,
    face: Annotated[bool, typer.Option(help="The phone shows its face in the film.")] = True,
    body: Annotated[
        str, typer.Option(help="simulated, or emulated-card: the real firmware in the loop.")
    ] = "simulated",
    calibration: CalibrationFile = None,
    robot: RobotFile = None,
    servo: ServoName = None,
    gestures: GesturesFolder = None,
    solver: IkWay = "default",
    as_json: AsJson = False,
) -> None:
    """Run the paper's experiment (Section 5): happiness, mood 0.9, and a hand in the way."""
    if body not in (bodies := ("simulated", "emulated-card")):
        raise InputError(
            f"the body must be one of {', '.join(bodies)}, got {body!r}: only a simulation has a "
            "hand to put in the way."
        )
    if servo is not None and body != "simulated":
        raise InputError("--servo is for the simulated body; the card's servos cannot be chosen.")
    if body == "emulated-card":
        from miburi.emulation.card import firmware_file

        firmware_file("miburi.elf")  # refused now, not after the gestures are checked
    from miburi.studies.experiment import Setup

    description, rule = calibrated(robot_of(robot, servo), calibration)
    setup = Setup(
        seed=seed,
        seconds=seconds,
        feeling=feeling,
        mood=mood,
        period=period,
        temperament=temperament_of(temperament),
        settings=settings_of(description, solver),
        hand=hand,
        heal=heal,
    )
    # After the quick checks, since this checks whether the robot reaches every pose.
    setup = replace(setup, repertoire=repertoire_of(description, gestures))
    simulation: Body
    if body == "emulated-card":
        from miburi.emulation.body import EmulatedBody

        simulation = EmulatedBody(description, rule)
    else:
        from miburi.bodies.simulated import Simulated

        simulation = Simulated(description, rule)
    from miburi.studies.experiment.files import write_experiment

    lines = write_experiment(simulation, setup, out, film=film, face=face)
    if as_json:
        print((out / "experiment.json").read_text(encoding="utf-8").rstrip())
    else:
        print(*lines, sep="\n")


def forward(
    angles: Annotated[
        list[float] | None,
        typer.Argument(help="Eight angles in rad: W RS RE RF LS LE LF H.", show_default=False),
    ] = None,
    robot: RobotFile = None,
    as_json: AsJson = False,
    printed: Annotated[
        bool, typer.Option("--as-printed", help="Use Eqs. 3–11 with their misprints.")
    ] = False,
) -> None:
    """Print where hands and head are, for eight angles or for JSON lines on standard input."""
    from miburi import robot as body

    description = robot_of(robot)
    solve = body.forward_as_printed if printed else body.forward
    for pose in [angles] if angles else _lines():
        row = _row(pose, 8, "angles", ["angles"])
        _warn_of_limits(description, row)
        place = solve(description, row).round(9)
        places = {
            name: place[3 * i : 3 * i + 3].tolist() for i, name in enumerate(body.EXTREMITIES)
        }
        if as_json:
            print(json.dumps(places))
        else:
            for name, (x, y, z) in places.items():
                print(f"{name:>5}  x {x:+.4f}  y {y:+.4f}  z {z:+.4f} m")


def _warn_of_limits(robot: "Robot", angles: list[float]) -> None:
    """Say on standard error which angles the robot's joints cannot reach."""
    from miburi.robot import JOINTS

    for name, angle, low, high in zip(JOINTS, angles, robot.lower, robot.upper, strict=True):
        if not low <= angle <= high:
            print(
                f"miburi: {name} is outside its limits: {angle:g} rad; allowed are {low:g} to "
                f"{high:g}.",
                file=sys.stderr,
            )


def paper(
    out: Annotated[Path, typer.Option(help="Folder for paper.md and images.")] = Path("out/paper"),
    claim: Annotated[
        str | None, typer.Option(help="Test this claim alone, and write nothing.")
    ] = None,
    robot: RobotFile = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the claim as JSON.")] = False,
) -> None:
    """Test the paper's claims; write a page with verdicts, numbers and figures."""
    need("scipy", "studies")
    if claim is not None:
        _carry_out_claim(claim, robot_of(robot), as_json=as_json)
        return
    check_folder("--out", out)
    from miburi.studies.paper.page import write_paper

    print(write_paper(robot_of(robot), out, lambda what: typer.echo(what, err=True)))


def _carry_out_claim(name: str, robot: "Robot", *, as_json: bool) -> None:
    """Print what a run says about one sentence of the paper."""
    from miburi.studies.paper.claims import CLAIMS
    from miburi.studies.paper.runs import Runs

    if name not in CLAIMS:
        raise InputError(f"--claim: one of {', '.join(CLAIMS)}, got {name!r}.")
    claim = CLAIMS[name](Runs(robot, lambda what: typer.echo(what, err=True)))
    if as_json:
        print(json.dumps({"claim": name, **asdict(claim)}, ensure_ascii=False))
        return
    print(f"Section {claim.section}: {claim.sentence}\n{claim.verdict}: {claim.number}")
    if claim.ours:
        print("Ours:", re.sub(r"\[.*?\]\((.*?)\)", r"docs/\1", claim.ours))


def ik(
    right: Annotated[Point | None, typer.Option(help="Right hand, m.", show_default=False)] = None,
    left: Annotated[Point | None, typer.Option(help="Left hand, m.", show_default=False)] = None,
    head: Annotated[Point | None, typer.Option(help="Head centre, m.", show_default=False)] = None,
    robot: RobotFile = None,
    solver: IkWay = "default",
    as_json: AsJson = False,
) -> None:
    """Print the angles that bring hands and head to places given as options or JSON lines on stdin.

    The exit code is 1 if one of them ends more than 1 mm away from its place.
    """
    from miburi.ik import solve
    from miburi.robot import EXTREMITIES, JOINTS

    description = robot_of(robot)
    settings = settings_of(description, solver)
    points = [point for point in (right, left, head) if point is not None]
    if points and len(points) < len(EXTREMITIES):
        given = [f"--{n}" for n, p in zip(EXTREMITIES, (right, left, head), strict=True) if p]
        raise InputError(
            "ik needs all of --right, --left and --head, each with X Y Z in m; got "
            f"{' and '.join(given)} alone."
        )
    missed = False
    for target in [[x for point in points for x in point]] if points else _lines():
        solution = solve(
            description, _row(target, 9, "coordinates", EXTREMITIES), settings=settings
        )
        missed |= solution.error.max() > _MISSED
        angles, error = solution.angles.round(9).tolist(), solution.error.round(9).tolist()
        if as_json:
            found = {"angles": angles, "error_m": error, "status": solution.status}
            found |= {
                "generations": solution.generations,
                "evaluations": solution.evaluations,
            }
            print(json.dumps(found))
        else:
            for name, angle in zip(JOINTS, angles, strict=True):
                print(f"{name:>15}  {angle:+.4f} rad")
            misses = ", ".join(
                f"{n} {1e3 * e:.3f} mm" for n, e in zip(EXTREMITIES, error, strict=True)
            )
            print(f"{solution.status}; error: {misses}")
    if missed:
        raise typer.Exit(1)


feelings_app = typer.Typer(help="The emotional model.", no_args_is_help=True)


@feelings_app.command()
def day(
    out: Annotated[Path, typer.Option(help="Folder for day.png.", callback=a_folder)] = Path(
        "out/feelings"
    ),
    seed: Annotated[int, typer.Option(help="0 or more.", min=0)] = 1,
    temperament: TemperamentName = "default",
    model: Annotated[str, typer.Option(help="cascade or spiking.")] = "cascade",
) -> None:
    """Draw the three levels over a scripted day of conversation."""
    from miburi.feelings import EmotionalModel
    from miburi.feelings.spiking import SpikingModel
    from miburi.studies.day import plot_day

    models = {"cascade": EmotionalModel, "spiking": SpikingModel}
    if model not in models:
        raise InputError(f"the model must be one of {', '.join(models)}, got {model!r}.")
    print(plot_day(out, models[model](temperament_of(temperament)), seed=seed))


def export(
    form: Annotated[str, typer.Argument(help="mjcf or urdf.")],
    robot: RobotFile = None,
    meshes: Annotated[
        Path | None,
        typer.Option(
            help="Folder to write the printed parts to; the model then shows them.",
            show_default=False,
            callback=a_folder,
        ),
    ] = None,
) -> None:
    """Print the robot as MJCF (MuJoCo) or URDF, made from its description."""
    from miburi.robot.mjcf import to_mjcf
    from miburi.robot.urdf import to_urdf

    forms = {"mjcf": to_mjcf, "urdf": to_urdf}
    if form not in forms:
        raise InputError(f"the form must be one of {', '.join(forms)}, got {form!r}.")
    body = robot_of(robot)
    print(forms[form](body, None if meshes is None else _write_meshes(body, meshes)), end="")


def _write_meshes(robot: "Robot", folder: Path) -> dict[tuple[str, str], str]:
    """Write the real shapes of each link, and return the files by link and colour."""
    need("manifold3d", "hardware")
    from miburi.ground.files import whole_files
    from miburi.hardware.files import stl
    from miburi.hardware.shapes import shapes

    files = {}
    with whole_files(folder) as draft:
        for (link, colour), solid in shapes(robot).items():
            name = f"{link}-{colour}.stl"
            (draft / name).write_bytes(stl(solid))
            files[link, colour] = str((folder / name).absolute())
    return files


for panel, commands in (
    (_LIVE, (run, status, feel, say, stop, listen, mcp, fleet)),
    (_MAKE, (words, template, export, forward, ik)),
    (_MEASURE, (experiment, trials, to_ros)),
    (_BUILD, (calibrate, tune)),
    (_DOCUMENTS, (paper, gallery, safety_page)),
):
    for command in commands:
        settings = _NEGATIVE_NUMBERS if command in (forward, ik) else None
        app.command(rich_help_panel=panel, context_settings=settings)(command)
for panel, name, group in (
    (_LIVE, "devices", devices_app),
    (_MAKE, "gesture", gesture_app),
    (_MAKE, "feelings", feelings_app),
    (_MEASURE, "study", study_app),
    (_BUILD, "card", card_app),
    (_BUILD, "hardware", hardware_app),
):
    app.add_typer(group, name=name, rich_help_panel=panel)


def _lines() -> Iterator[Any]:
    """Parse standard input, one JSON value a line; skip empty lines."""
    if sys.stdin.isatty():
        raise InputError("give the numbers as arguments, or as JSON lines on standard input.")
    for number, line in enumerate(sys.stdin, start=1):
        if line.strip():
            try:
                yield json.loads(line)
            except (ValueError, RecursionError) as error:  # a long number, or deep nesting
                why = error.msg if isinstance(error, json.JSONDecodeError) else error
                raise InputError(
                    f"line {number} is not JSON: {why}; got {line.strip()[:60]!r}. A line is a "
                    "list of numbers, or what the other of `miburi forward` and `miburi ik` prints "
                    "with --json."
                ) from error


def _row(values: Any, width: int, what: str, keys: Sequence[str]) -> list[float]:
    """Return a row of numbers; from an object that the other command printed, those of ``keys``."""
    if isinstance(values, dict):
        parts = [values.get(key) for key in keys]
        values = [x for part in parts for x in (part if isinstance(part, list) else [part])]
    numbers = isinstance(values, list) and all(
        isinstance(value, int | float) and not isinstance(value, bool) for value in values
    )
    if not numbers or len(values) != width:
        raise InputError(f"{width} {what} are needed, got {json.dumps(values)[:120]}.")
    return list(values)
