"""``miburi forward`` and ``ik``: convert eight angles to positions of hands and head, and back."""

import json
import sys
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from miburi.cli.options import AsJson, IkWay, RobotFile, robot_of, settings_of
from miburi.errors import InputError

if TYPE_CHECKING:
    from miburi.robot import Robot


#: How far, in m, a hand or the head may be from its target (our choice).
_MISSED = 1e-3

Point = tuple[float, float, float]


def forward(
    angles: Annotated[
        list[float] | None,
        typer.Argument(help="Eight angles in rad: W RS RE RF LS LE LF H."),
    ] = None,
    robot: RobotFile = None,
    as_json: AsJson = False,
    printed: Annotated[
        bool,
        typer.Option(
            "--as-printed", help="Use the paper's Eqs. 3–11 as printed, misprints and all."
        ),
    ] = False,
) -> None:
    """Print positions of hands and head for eight angles, or for JSON lines on stdin."""
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


def ik(
    right: Annotated[Point | None, typer.Option(help="Right hand's position, m.")] = None,
    left: Annotated[Point | None, typer.Option(help="Left hand's position, m.")] = None,
    head: Annotated[Point | None, typer.Option(help="Head centre, m.")] = None,
    robot: RobotFile = None,
    solver: IkWay = "default",
    seed: Annotated[
        int | None,
        typer.Option(help="Another seed for --ik residual or paper; default: 0.", min=0),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Print the angles that bring hands and head to positions (options, or JSON lines on stdin).

    The exit code is 1 if a hand or the head ends more than 1 mm away from its target.
    """
    from miburi.ik import solve
    from miburi.robot import EXTREMITIES, JOINTS

    description = robot_of(robot)
    settings = settings_of(description, solver)
    if seed is not None and settings is None:
        raise InputError("--seed is for --ik residual or paper: the default solver draws nothing.")
    points = [point for point in (right, left, head) if point is not None]
    if points and len(points) < len(EXTREMITIES):
        given = [f"--{n}" for n, p in zip(EXTREMITIES, (right, left, head), strict=True) if p]
        raise InputError(
            "ik needs all of --right, --left and --head, each with X Y Z in m; got "
            f"only {' and '.join(given)}."
        )
    missed = False
    for target in [[x for point in points for x in point]] if points else _lines():
        solution = solve(
            description,
            _row(target, 9, "coordinates", EXTREMITIES),
            settings=settings,
            seed=seed or 0,
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


def _warn_of_limits(robot: "Robot", angles: list[float]) -> None:
    """Say on standard error which angles are outside the joints' limits."""
    from miburi.robot import JOINTS

    for name, angle, low, high in zip(JOINTS, angles, robot.lower, robot.upper, strict=True):
        if not low <= angle <= high:
            print(
                f"miburi: {name} is outside its limits: {angle:g} rad; it must be from {low:g} to "
                f"{high:g}.",
                file=sys.stderr,
            )


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
                    "list of numbers, or the --json output of the opposite command (`miburi "
                    "forward` or `miburi ik`)."
                ) from error


def _row(values: Any, width: int, what: str, keys: Sequence[str]) -> list[float]:
    """Return a row of numbers, or the numbers under ``keys`` of an object."""
    if isinstance(values, dict):
        parts = [values.get(key) for key in keys]
        values = [x for part in parts for x in (part if isinstance(part, list) else [part])]
    numbers = isinstance(values, list) and all(
        isinstance(value, int | float) and not isinstance(value, bool) for value in values
    )
    if not numbers or len(values) != width:
        raise InputError(f"{width} {what} are needed, got {json.dumps(values)[:120]}.")
    return list(values)
