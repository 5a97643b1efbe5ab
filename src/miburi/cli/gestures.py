"""``miburi gesture …`` and ``miburi gallery``: parse, call, print."""

import json
from pathlib import Path
from typing import Annotated

import typer

from miburi.cli.options import GesturesFolder, RobotFile, gesture_of, repertoire_of, robot_of
from miburi.errors import InputError

__all__ = [
    "Face",
    "Source",
    "Step",
    "check",
    "classify",
    "gallery",
    "gesture_app",
    "measures",
    "preview",
    "schema",
]

gesture_app = typer.Typer(
    help="Gestures: measure them, check them, look at them.", no_args_is_help=True
)

Source = Annotated[str, typer.Argument(help="A gesture file (….toml), or a feeling's name.")]
Face = Annotated[bool, typer.Option("--face", help="The phone shows the feeling's face.")]
Step = Annotated[float, typer.Option(help="From one mood to the next, 0.01 to 1.")]


@gesture_app.command()
def measures(
    feeling: Annotated[
        list[str] | None, typer.Argument(help="Feelings, or gesture files; default: all feelings.")
    ] = None,
    step: Step = 0.05,
    as_json: Annotated[bool, typer.Option("--json", help="A line of JSON each.")] = False,
    robot: RobotFile = None,
) -> None:
    """Laban's effort of each gesture at each mood, measured on the simulated body."""
    from miburi.studies.gestures.check import moods, perform

    body = robot_of(robot)
    named = [gesture_of(body, source) for source in feeling or ()]
    for function in named or repertoire_of(body, None).functions:
        for mood in moods(_checked(step)):
            result = perform(body, function, mood)
            found = result.measures
            if as_json:
                print(json.dumps(result.as_json()), flush=True)
            else:
                print(
                    f"{result.feeling:>9} μ {mood:<5g} {1e6 * found.volume:7.1f} cm³  "
                    f"{found.mean_speed:.4f} m/s  {found.mean_acceleration:5.2f} m/s²  "
                    f"{found.mean_jerk:6.1f} m/s³  directness {found.directness:.2f}  "
                    f"ik {1e3 * result.ik_error:.3f} mm  self-collisions "
                    f"{result.self_collisions}  contact stops {result.contact_stops}",
                    flush=True,
                )


@gesture_app.command()
def check(source: Source, step: Step = 0.1, robot: RobotFile = None) -> None:
    """Check a gesture: reach, limits, self-collision, contact rule, more mood more movement."""
    from miburi.gestures import load
    from miburi.studies.gestures.check import check as problems_of

    function = load(source)
    problems = list(problems_of(robot_of(robot), function, step=_checked(step)))
    for problem in problems:
        print(f"{source}: {problem}.")
    if problems:
        raise typer.Exit(1)
    print(f"{source}: all is well at every mood from 0 to 1 in steps of {step:g}.")


@gesture_app.command()
def preview(
    source: Source,
    mood: Annotated[float, typer.Option(help="0 to 1.")] = 0.9,
    out: Annotated[Path, typer.Option(help="Folder for film and pictures.")] = Path("out/gesture"),
    face: Face = False,
    robot: RobotFile = None,
) -> None:
    """Film a gesture, draw six moments of it, and the paths of its hands."""
    from miburi.ground.files import whole_files
    from miburi.studies.gestures.pictures import camera_on, show

    body = robot_of(robot)
    function = gesture_of(body, source)
    with whole_files(out) as draft, camera_on(body) as camera:
        shown = show(body, function, mood, draft, camera, face=face)
    for name in (shown.film, shown.strip, shown.paths):
        print(out / name)


@gesture_app.command()
def classify(
    variations: Annotated[int, typer.Option(help="Learnt and named, of each.", min=1)] = 8,
    seed: Annotated[int, typer.Option(help="0 or more.", min=0)] = 0,
    robot: RobotFile = None,
    gestures: GesturesFolder = None,
) -> None:
    """Tell the gestures apart by measures alone: learnt at 0.5 and 0.9, named at 0.7 and 0.3."""
    from miburi.feelings import FEELINGS
    from miburi.studies.gestures.classifier import confusion, learn

    body = robot_of(robot)
    repertoire = repertoire_of(body, gestures)
    classifier = learn(body, repertoire, variations=variations, seed=seed)
    for mood in (0.7, 0.3):
        table = confusion(
            body, repertoire, classifier, mood, variations=variations, seed=seed + variations
        )
        print(f"mood {mood}: {table.trace()} of {table.sum()} named right "
              f"({table.trace() / table.sum():.1%})")  # fmt: skip
        print(" " * 10 + "".join(f"{name:>10}" for name in FEELINGS))
        for name, row in zip(FEELINGS, table, strict=True):
            print(f"{name:>10}" + "".join(f"{count or '·':>10}" for count in row))


@gesture_app.command()
def schema() -> None:
    """Print the JSON schema of a gesture file, for editors."""
    from miburi.gestures import MovementFunction

    print(json.dumps(MovementFunction.model_json_schema(), indent=2))


def gallery(
    out: Annotated[Path, typer.Option(help="Folder for the page.")] = Path("out/gallery"),
    face: Face = False,
    robot: RobotFile = None,
    gestures: GesturesFolder = None,
) -> None:
    """Film every gesture at three moods, and show them all on one page."""
    from miburi.studies.gestures.gallery import write_gallery

    def say(what: str) -> None:
        typer.echo(what, err=True)

    body = robot_of(robot)
    print(write_gallery(body, repertoire_of(body, gestures), out, face=face, progress=say))


def _checked(step: float) -> float:
    if not 0.01 <= step <= 1:
        raise InputError(f"--step must be from 0.01 to 1, got {step!r}.")
    return step
