"""``miburi hardware …``: parts to print, bill of materials, gauge, checks and pictures."""

import json
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from miburi.cli.options import AsJson
from miburi.cli.places import a_file, a_folder, must_not_replace
from miburi.errors import need

if TYPE_CHECKING:
    from miburi.hardware.build import PrintedPart
    from miburi.robot import Array, Robot


hardware_app = typer.Typer(help="Print and build the robot's body.", no_args_is_help=True)

RobotToBuild = Annotated[
    Path | None,
    typer.Option("--robot", help="A robot description; default: the buildable one."),
]
Fit = Annotated[
    float,
    typer.Option(
        help="Gap on each side of a servo in its pocket, in mm; print the gauge to find it."
    ),
]
Output = Annotated[Path, typer.Option(help="Folder to write to.", callback=a_folder)]

#: The moods at which gestures are checked; and the interval between two checks, in poses.
_MOODS, _EACH = (0.3, 0.6, 0.9, 1.0), 3


def _robot(file: Path | None) -> "Robot":
    from miburi.robot import buildable, load_robot

    need("manifold3d", "hardware")
    return buildable() if file is None else load_robot(file)


def _write(folder: Path, made: Iterable["PrintedPart"], formats: Iterable[str]) -> None:
    from miburi.ground.files import whole_files
    from miburi.hardware.exports import encode

    made = list(made)
    with whole_files(folder) as draft:
        for part in made:
            solid = part.on_the_bed
            for ending in formats:
                file = draft / f"{part.name}.{ending}"
                file.write_bytes(encode(solid, part.name, ending))
    for part in made:
        x, y, z, right, back, top = part.on_the_bed.bounding_box()
        print(f"{part.name:16} {right - x:5.0f} × {back - y:3.0f} × {top - z:3.0f} mm")
    print(f"{len(made)} parts, as {' and '.join(formats)} in {folder}.")


@hardware_app.command()
def parts(
    robot: RobotToBuild = None,
    fit: Fit = 0.25,
    out: Output = Path("parts"),
    step: Annotated[bool, typer.Option(help="Write STEP files, too (faceted).")] = False,
) -> None:
    """Write every part to print as 3MF and STL, each as it lies on the printer's bed."""
    body = _robot(robot)
    from miburi.hardware.build import printed_parts

    _write(out, printed_parts(body, fit), ("3mf", "stl", *(("step",) if step else ())))


@hardware_app.command()
def gauge(out: Output = Path("gauge")) -> None:
    """Write the gauge: print it first, and see which pocket fits."""
    need("manifold3d", "hardware")
    from miburi.hardware.gauge import FITS
    from miburi.hardware.gauge import gauge as make

    _write(out, make(), ("3mf", "stl"))
    print(
        f"Print it as you will print the parts. Find the pocket that a servo slides into, and pass "
        f"its number with --fit: {', '.join(f'{fit:g}' for fit in FITS[:-1])} or {FITS[-1]:g}."
    )


@hardware_app.command()
def bill(
    robot: RobotToBuild = None,
    fit: Fit = 0.25,
    csv: Annotated[
        Path | None, typer.Option(help="Write a CSV file, too.", callback=a_file)
    ] = None,
    slicing: Annotated[
        bool, typer.Option("--slice", help="Let PrusaSlicer compute grams and hours.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Print what to buy and what to print."""
    from rich.console import Console
    from rich.table import Table

    from miburi.errors import MiburiError

    must_not_replace(csv, robot)
    body = _robot(robot)
    from miburi.hardware.bill import bill as rows_of
    from miburi.hardware.bill import priced, slicer, to_csv
    from miburi.hardware.build import printed_parts

    program = slicer() if slicing else None
    if slicing and program is None:
        raise MiburiError("--slice needs PrusaSlicer (Debian: prusa-slicer).")
    rows = list(rows_of(body, printed_parts(body, fit), program))
    if csv is not None:
        from miburi.ground.files import whole_files

        with whole_files(csv.parent) as draft:
            (draft / csv.name).write_text(to_csv(rows), encoding="utf-8")
    if as_json:
        print(*(json.dumps(asdict(row), ensure_ascii=False) for row in rows), sep="\n")
    else:
        table = Table("count", "what", "number", "price", "grams", "time", "remark")
        for row in rows:
            price = "" if row.price is None else f"{row.price:g} {row.currency}"
            grams = "" if row.grams is None else str(row.grams)
            table.add_row(str(row.count), row.name, row.number, price, grams, row.time, row.remark)
        Console().print(table)
        print(priced(rows))


@hardware_app.command()
def check(robot: RobotToBuild = None, fit: Fit = 0.25, as_json: AsJson = False) -> None:
    """Check that the robot can be built: walls, joints, gestures, torque, tipping, cables."""
    body = _robot(robot)
    from miburi.bodies.rehearsal import PERIOD
    from miburi.hardware.check import check as findings

    wrong, (motions, stopped) = 0, _motions(body)
    for finding in findings(body, motions, PERIOD * _EACH, fit, stopped):
        words = f"{'ok' if finding.ok else 'NO':3} {finding.check:16} {finding.words}."
        print(json.dumps(asdict(finding), ensure_ascii=False) if as_json else words, flush=True)
        wrong += not finding.ok
    if wrong:
        if not as_json:
            print(f"{wrong} of the checks failed.")
        raise typer.Exit(1)


def _motions(robot: "Robot") -> tuple[dict[str, "Array"], list[str]]:
    """Return the simulated body's motion in every shipped gesture, and the names of stopped ones.

    Each gesture is performed at several moods.
    """
    from miburi.bodies.rehearsal import rehearse
    from miburi.cli.options import repertoire_of
    from miburi.gestures import key_poses

    motions, stopped = {}, []
    for function in repertoire_of(robot, None).functions:
        for mood in _MOODS:
            name = f"{function.name} at {mood:g}"
            done = rehearse(robot, key_poses(robot, function, mood))
            motions[name] = done.angles[::_EACH]
            if done.stop is not None:
                stopped.append(name)
    return motions, stopped


@hardware_app.command()
def pictures(
    robot: RobotToBuild = None, fit: Fit = 0.25, out: Output = Path("build-pictures")
) -> None:
    """Draw the robot and each step of its assembly."""
    body = _robot(robot)
    from miburi.ground.files import whole_files
    from miburi.hardware.pictures import STEPS, draw_step, write_png

    with whole_files(out) as draft:
        for number, step in enumerate(STEPS):
            write_png(draft / f"step-{number:02}.png", draw_step(body, fit, number))
            print(f"step-{number:02}.png  {step.title}", flush=True)
