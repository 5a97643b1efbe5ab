"""``miburi experiment``, ``paper`` and ``feelings day``: run and draw the paper's experiments."""

import json
import re
import sys
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from miburi.cli.options import (
    AsJson,
    CalibrationFile,
    EmotionalModelName,
    GesturesFolder,
    IkWay,
    RobotFile,
    ServoName,
    TemperamentName,
    calibrated,
    command_line,
    emotional_model_of,
    repertoire_of,
    robot_of,
    settings_of,
    temperament_of,
)
from miburi.cli.places import a_folder, check_folder
from miburi.errors import InputError, need

if TYPE_CHECKING:
    from miburi.bodies import Body
    from miburi.robot import Robot


def experiment(
    context: typer.Context,
    seed: Annotated[
        int,
        typer.Option(
            help="0 or more; the same seed gives the same run. It chooses when and where the hand "
            "blocks, and among several gestures of the feeling."
        ),
    ] = 1,
    seconds: Annotated[float, typer.Option(help="Length on the robot's clock, s.")] = 30.0,
    feeling: Annotated[str, typer.Option(help="The emotion that is kept constant.")] = "happiness",
    mood: Annotated[float, typer.Option(help="Its mood at the start, 0 to 1.")] = 0.9,
    period: Annotated[float, typer.Option(help="Seconds from gesture to gesture.")] = 2.0,
    heal: Annotated[
        bool,
        typer.Option(
            "--heal",
            help="After the gestures, let the mood recover, and compare it with that of a "
            "robot that nobody touched.",
        ),
    ] = False,
    temperament: TemperamentName = "default",
    model: EmotionalModelName = "cascade",
    out: Annotated[Path, typer.Option(help="Folder for the results.", callback=a_folder)] = Path(
        "out/experiment"
    ),
    film: Annotated[bool, typer.Option(help="Also make the film; this takes longest.")] = True,
    hand: Annotated[bool, typer.Option(help="A hand gets in the way now and then.")] = True,
    face: Annotated[
        bool, typer.Option(help="Show the robot's face on the phone in the film.")
    ] = True,
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
        from miburi.emulation.firmware import firmware_file

        firmware_file("miburi.elf")  # refused now, not after the gestures are checked
    from miburi.studies.experiment import Setup
    from miburi.studies.provenance import provenance

    described = robot_of(robot, servo)
    description, rule = calibrated(described, calibration)
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
        model=emotional_model_of(model),
        chosen={
            "robot": robot.name if robot else description.name,
            "body": body,
            "calibration": calibration.name if calibration else None,
            "repertoire": gestures.name if gestures else "shipped",
            "solver": solver,
        },
    )
    # This comes after the quick checks, because it checks every pose.
    repertoire = repertoire_of(description, gestures)
    origin = provenance(
        robot=described,
        temperament=setup.temperament,
        repertoire=repertoire,
        calibration=calibration,
    )
    chosen = {**setup.chosen, "command": command_line(context), **origin}
    setup = replace(setup, repertoire=repertoire, chosen=chosen)
    simulation: Body
    if body == "emulated-card":
        from miburi.emulation.body import EmulatedBody

        simulation = EmulatedBody(description, rule)
    else:
        from miburi.bodies.simulated import Simulated

        simulation = Simulated(description, rule)
    from miburi.studies.experiment.results import write_experiment

    lines = write_experiment(simulation, setup, out, film=film, face=face)
    if as_json:
        print(json.dumps(json.loads((out / "experiment.json").read_text(encoding="utf-8"))))
    else:
        print(*lines, sep="\n")


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

    print(
        "This takes about twelve minutes. If you interrupt it, it starts from the beginning.",
        file=sys.stderr,
    )
    print(write_paper(robot_of(robot), out, partial(typer.echo, err=True)))


def _carry_out_claim(name: str, robot: "Robot", *, as_json: bool) -> None:
    from miburi.studies.paper.claims import CLAIMS
    from miburi.studies.paper.runs import Runs

    if name not in CLAIMS:
        raise InputError(f"--claim: one of {', '.join(CLAIMS)}, got {name!r}.")
    claim = CLAIMS[name](Runs(robot, partial(typer.echo, err=True)))
    if as_json:
        print(json.dumps({"claim": name, **asdict(claim)}, ensure_ascii=False))
        return
    print(f"Section {claim.section}: {claim.sentence}\n{claim.verdict}: {claim.number}")
    if claim.ours:
        print("Ours:", re.sub(r"\[.*?\]\((.*?)\)", r"docs/\1", claim.ours))


def day(
    context: typer.Context,
    out: Annotated[
        Path, typer.Option(help="Folder for day.png and day.csv.", callback=a_folder)
    ] = Path("out/feelings"),
    seed: Annotated[int, typer.Option(help="0 or more.", min=0)] = 1,
    temperament: TemperamentName = "default",
    emotional_model: EmotionalModelName = "cascade",
) -> None:
    """Draw emotion, feeling and mood over a scripted day of conversation; also as a table."""
    from miburi.studies.day import plot_day
    from miburi.studies.provenance import provenance

    character = temperament_of(temperament)
    model = emotional_model_of(emotional_model)(character)
    about = {"command": command_line(context), **provenance(temperament=character)}
    print(plot_day(out, model, seed=seed, about=about))
