"""``miburi gesture …`` and ``miburi gallery``: parse the arguments, call, print."""

import json
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from miburi.cli.live import HERE, PartnerAddress, partner_at
from miburi.cli.options import (
    AsJson,
    GesturesFolder,
    IkWay,
    RobotFile,
    gesture_of,
    repertoire_of,
    robot_of,
    settings_of,
)
from miburi.cli.places import a_folder
from miburi.errors import InputError, OutputError, need

if TYPE_CHECKING:
    from miburi.live.state import State
    from miburi.robot import Array


gesture_app = typer.Typer(help="Measure, check and film gestures.", no_args_is_help=True)

Source = Annotated[str, typer.Argument(help="A gesture file (….toml), or a feeling's name.")]
Face = Annotated[bool, typer.Option(help="The phone shows the feeling's face.")]
Step = Annotated[float, typer.Option(help="Step from one mood to the next, 0.01 to 1.")]


@gesture_app.command()
def measures(
    feeling: Annotated[
        list[str] | None, typer.Argument(help="Feelings, or gesture files; default: all feelings.")
    ] = None,
    step: Step = 0.05,
    as_json: AsJson = False,
    robot: RobotFile = None,
    solver: IkWay = "default",
) -> None:
    """Measure Laban's effort of each gesture at each mood, on the simulated body."""
    need("scipy", "studies")
    from miburi.studies.gestures.check import moods, perform

    body = robot_of(robot)
    settings = settings_of(body, solver)
    chosen = [gesture_of(body, source) for source in feeling or ()]
    for function in chosen or repertoire_of(body, None).functions:
        for mood in moods(_check_step(step)):
            result = perform(body, function, mood, settings)
            values = result.measures
            if as_json:
                print(json.dumps(result.as_json()), flush=True)
            else:
                print(
                    f"{result.feeling:>9} μ {mood:<5g} {1e6 * values.volume:7.1f} cm³  "
                    f"{values.mean_speed:.4f} m/s  {values.mean_acceleration:5.2f} m/s²  "
                    f"{values.mean_jerk:6.1f} m/s³  directness {values.directness:.2f}  "
                    f"ik {1e3 * result.ik_error:.3f} mm  self-collisions "
                    f"{result.self_collisions}  contact stops {result.contact_stops}",
                    flush=True,
                )


@gesture_app.command()
def check(
    source: Source,
    step: Step = 0.1,
    robot: RobotFile = None,
    solver: IkWay = "default",
    as_json: AsJson = False,
) -> None:
    """Check a gesture: reach, limits, self-collision, contact rule, and growth with mood."""
    from miburi.gestures import load
    from miburi.studies.gestures.check import check as problems_of

    function = load(source)
    body = robot_of(robot)
    settings = settings_of(body, solver)
    problems = list(problems_of(body, function, step=_check_step(step), settings=settings))
    if as_json:
        print(json.dumps({"source": source, "problems": problems}, ensure_ascii=False))
        raise typer.Exit(int(bool(problems)))
    for problem in problems:
        print(f"{source}: {problem}.")
    if problems:
        raise typer.Exit(1)
    print(f"{source}: all is well at every mood from 0 to 1 in steps of {step:g}.")


@gesture_app.command()
def preview(
    source: Source,
    mood: Annotated[float, typer.Option(help="0 to 1.")] = 0.9,
    out: Annotated[
        Path, typer.Option(help="Folder for film and pictures.", callback=a_folder)
    ] = Path("out/gesture"),
    face: Face = True,
    robot: RobotFile = None,
    solver: IkWay = "default",
) -> None:
    """Film a gesture; draw twelve moments of it and the paths of the robot's hands."""
    if not 0 <= mood <= 1:
        raise InputError(f"--mood must be from 0 to 1, got {mood!r}.")
    from miburi.ground.files import whole_files
    from miburi.studies.gestures.pictures import camera_on, show

    body = robot_of(robot)
    function = gesture_of(body, source)
    with whole_files(out) as draft, camera_on(body) as camera:
        settings = settings_of(body, solver)
        pictures = show(body, function, mood, draft, camera, face=face, settings=settings)
    for name in (pictures.film, pictures.strip, pictures.paths):
        print(out / name)
    if pictures.fault:
        typer.echo(f"miburi: {source} at mood {mood:g} is {pictures.fault}.", err=True)


_LEAD = "Take a hand of the resting robot and guide it slowly. To end, keep still for 2 s."
#: If no state arrives for longer than this, in s, the recording may have a gap (our choice).
_GAP = 0.5


@gesture_app.command()
def record(
    name: Annotated[str, typer.Argument(help="Name of the new gesture, such as wave.")],
    feeling: Annotated[str, typer.Option(help="The feeling that it shows.")] = "happiness",
    out: Annotated[Path, typer.Option(help="Folder for its file.", callback=a_folder)] = Path(
        "mine"
    ),
    url: PartnerAddress = HERE,
    step: Step = 0.1,
    robot: RobotFile = None,
) -> None:
    """Lead a resting robot by its hand, and keep what you showed it as a gesture."""
    from miburi.gestures.taught import as_toml, check_name, taught
    from miburi.ground.files import whole_files

    file = out / f"{name}.toml"
    check_name(name, feeling)
    _check_step(step)
    if file.exists():
        raise OutputError(f"{file} already exists; choose another name.")
    body = robot_of(robot)
    # The folder is checked first, so that no gesture is shown in vain.
    with whole_files(out) as draft, partner_at(url) as partner:
        if (its := partner.robot.name) != body.name:
            raise InputError(
                f"the partner's robot is {its}, not {body.name}; give its file: --robot."
            )
        goes_on = not partner.state.paused  # a paused partner stays paused
        if goes_on:
            partner.pause()  # else it would look around, and meet the hand
        try:
            print(_LEAD, flush=True)
            times, angles = _shown(partner.watch(50))
        finally:
            if goes_on:
                partner.pause(False)
        function = taught(body, name, feeling, times, angles)
        (draft / file.name).write_text(as_toml(function), "utf-8")
    print(f"{file}: {len(function.pose)} key poses in {function.duration} s.")
    check(str(file), step=step, robot=robot)


def _shown(states: "Iterable[State]") -> "tuple[Array, Array]":
    """Return the times, (n,) in s, and angles, (n, 8) in rad, while a person guides a hand.

    This returns only when the body is back at neutral, so that nothing else moves it in the
    person's hands.
    """
    import numpy as np

    from miburi.safety.stop import StopReason

    shown: list[State] = []
    over = False
    for state in states:
        reason = state.stop.reason if state.stop else None
        if reason is not None and not reason.passes:
            raise InputError(
                f"the body is stopped ({reason}); release the body, then show the gesture again."
            )
        led = reason is StopReason.TOUCHED and state.phase == "stopped"
        over = over or bool(shown and not led)
        if over and state.phase == "idle":
            break
        if led and not over:
            if not shown:
                print("Recording.", flush=True)
            elif state.time - shown[-1].time > _GAP:
                raise InputError("the connection was lost meanwhile; show it again.")
            shown.append(state)
    return np.array([one.time for one in shown]), np.array([one.angles for one in shown])


@gesture_app.command()
def classify(
    variations: Annotated[
        int, typer.Option(help="Variations of each gesture, to train and to test with.", min=1)
    ] = 8,
    seed: Annotated[int, typer.Option(help="0 or more.", min=0)] = 0,
    robot: RobotFile = None,
    gestures: GesturesFolder = None,
    as_json: AsJson = False,
) -> None:
    """Classify gestures by their motion: train at moods 0.5 and 0.9, test at 0.7 and 0.3."""
    from miburi.feelings import FEELINGS
    from miburi.studies.gestures.classifier import confusion, learn

    body = robot_of(robot)
    repertoire = repertoire_of(body, gestures)
    classifier = learn(body, repertoire, variations=variations, seed=seed)
    for mood in (0.7, 0.3):
        table = confusion(
            body, repertoire, classifier, mood, variations=variations, seed=seed + variations
        )
        if as_json:
            print(json.dumps({"mood": mood, "names": list(FEELINGS), "named": table.tolist()}))
            continue
        print(f"mood {mood}: {table.trace()} of {table.sum()} classified correctly "
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
    out: Annotated[Path, typer.Option(help="Folder for the page.", callback=a_folder)] = Path(
        "out/gallery"
    ),
    face: Face = False,
    robot: RobotFile = None,
    gestures: GesturesFolder = None,
) -> None:
    """Film every gesture at three moods, and write a page with all of them."""
    from miburi.studies.gestures.gallery import write_gallery

    body, report = robot_of(robot), partial(typer.echo, err=True)
    print(write_gallery(body, repertoire_of(body, gestures), out, face=face, progress=report))


def _check_step(step: float) -> float:
    if not 0.01 <= step <= 1:
        raise InputError(f"--step must be from 0.01 to 1, got {step!r}.")
    return step
