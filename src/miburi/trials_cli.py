"""The command line of contact trials: ``miburi trials``, ``miburi calibrate``, ``miburi tune``."""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated

import typer

from miburi.errors import InputError

if TYPE_CHECKING:
    from miburi.robot import Robot
    from miburi.trials.runs import Plan

RobotFile = Annotated[
    Path | None, typer.Option("--robot", help="A robot description; default: the iphonoid.")
]
Calibration = Annotated[
    Path | None, typer.Option(help="Guards from miburi calibrate or miburi tune.")
]
Workers = Annotated[int, typer.Option(help="Processes on this machine.", min=1)]
Seed = Annotated[int, typer.Option(help="0 or more.", min=0)]


def trials(
    free: Annotated[int, typer.Option(help="Trials with nobody in the way.", min=0)] = 1000,
    blocked: Annotated[int, typer.Option(help="Trials with somebody in the way.", min=0)] = 1000,
    seed: Seed = 1,
    workers: Workers = 1,
    out: Annotated[Path | None, typer.Option(help="Parquet file, a row each trial.")] = None,
    servos: Annotated[
        int, typer.Option(help="0: the servo described; N: N varied ones, each calibrated.", min=0)
    ] = 0,
    rule: Annotated[str, typer.Option(help="miburi, or the paper's as printed.")] = "miburi",
    calibration: Calibration = None,
    ray: Annotated[str | None, typer.Option(help="Address of a Ray cluster.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Answer as JSON.")] = False,
    robot: RobotFile = None,
) -> None:
    """Let simulated people get in the robot's way, and count what the contact rule does."""
    from miburi.trials.runs import run
    from miburi.trials.summary import summarise

    plan = _plan(robot, calibration, rule, servos, seed, free, blocked)
    counts: list[int] = []
    began = perf_counter()
    with _progress() as show:

        def progress(done: int, total: int) -> None:
            counts.append(done)
            show(done, total)

        outcomes = run(plan, out, workers=workers, ray=ray, progress=progress)
    # What a broken-off run had done before is not this one's speed.
    rate = (counts[-1] - counts[0]) / (perf_counter() - began)
    found = summarise(outcomes)
    if as_json:
        print(json.dumps({**found.as_json(), "trials_per_second": round(rate, 2)}))
        return
    from miburi.trials.report import in_words

    print(in_words(found))
    print(f"{rate:.1f} trials/s" + (f"; written to {out}" if out else ""))


def calibrate(
    out: Annotated[Path, typer.Option(help="The calibration file to write.")],
    seed: Seed = 1,
    moves: Annotated[int, typer.Option(help="Free moves to measure.", min=2)] = 120,
    robot: RobotFile = None,
) -> None:
    """Measure the simulated servos of a robot in free motion, and write their guards."""
    from miburi.calibration_file import write_calibration
    from miburi.files import whole_files
    from miburi.trials.replay import calibrated

    body = _robot(robot)
    rule = calibrated(body, seed, moves)
    with whole_files(out.parent) as draft:
        note = f"Contact rule of {body.name}: calibrated from {moves} free moves, seed {seed}."
        write_calibration(body, rule, draft / out.name, note)
    print(out)


def _plan(
    path: Path | None,
    calibration: Path | None,
    rule_name: str,
    servos: int,
    seed: int,
    free: int,
    blocked: int,
) -> "Plan":
    from miburi.calibration_file import read_calibration
    from miburi.contact import PrintedRule, Rule
    from miburi.trials.conditions import varied_servos
    from miburi.trials.replay import calibrated
    from miburi.trials.runs import Plan

    if rule_name not in ("miburi", "printed"):
        raise InputError(f'--rule must be "miburi" or "printed", got {rule_name!r}.')
    if calibration is not None and servos:
        raise InputError("--servos calibrates each servo itself: leave out --calibration.")
    body = _robot(path)
    if servos:
        watched = [(one, calibrated(one, seed)) for one in varied_servos(body, seed, servos)]
    elif calibration is not None:
        watched = [read_calibration(body, calibration)]
    else:
        watched = [(body, Rule.of(body))]
    if rule_name == "printed":
        watched = [(one, PrintedRule(rule.guards)) for one, rule in watched]
    return Plan(tuple(watched), seed, free, blocked)


def _robot(path: Path | None) -> "Robot":
    from miburi.robot import iphonoid, load_robot

    return iphonoid() if path is None else load_robot(path)


@contextmanager
def _progress() -> Iterator[Callable[[int, int], None]]:
    """Show how far a run is, on standard error, where somebody looks."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn

    columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("trials", total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
