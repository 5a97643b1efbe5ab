"""``miburi trials``, ``calibrate``, ``tune``, ``safety-page``: parse the arguments, call, print."""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated

import typer

from miburi.cli.options import (
    CalibrationFile,
    GesturesFolder,
    RobotFile,
    ServoName,
    calibrated,
    repertoire_of,
    robot_of,
)
from miburi.errors import InputError
from miburi.ground.cores import available_cores

if TYPE_CHECKING:
    from miburi.gestures import Repertoire
    from miburi.robot import Robot
    from miburi.studies.trials.runs import Plan

__all__ = ["Seed", "Workers", "calibrate", "safety_page", "show_progress", "trials", "tune"]

Workers = Annotated[
    int | None, typer.Option(help="Processes on this machine; default: one for each core.", min=1)
]
Seed = Annotated[int, typer.Option(help="0 or more.", min=0)]


def trials(
    free: Annotated[int, typer.Option(help="Trials with nobody in the way.", min=0)] = 1000,
    blocked: Annotated[int, typer.Option(help="Trials with somebody in the way.", min=0)] = 1000,
    seed: Seed = 1,
    workers: Workers = None,
    out: Annotated[
        Path | None, typer.Option(help="Parquet file to write, a row for each trial.")
    ] = None,
    servos: Annotated[
        int,
        typer.Option(
            help="0: the robot as described; N: N as from a workshop, each calibrated.", min=0
        ),
    ] = 0,
    rule: Annotated[
        str,
        typer.Option(
            help="miburi; printed: the paper's rule as printed; off: no rule, to see what the "
            "limit of the motors' push brings alone."
        ),
    ] = "miburi",
    calibration: CalibrationFile = None,
    ray: Annotated[str | None, typer.Option(help="Address of a Ray cluster to use.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Answer as JSON.")] = False,
    robot: RobotFile = None,
    servo: ServoName = None,
    gestures: GesturesFolder = None,
) -> None:
    """Put simulated people in the robot's way, and count what the contact rule does."""
    from miburi.studies.trials.runs import carry_out_plan
    from miburi.studies.trials.summary import summarise

    workers = workers or available_cores()
    body = robot_of(robot, servo)
    repertoire = repertoire_of(body, gestures)
    plan = _plan(body, repertoire, calibration, rule, servos, seed, free, blocked, workers)
    counts: list[int] = []
    began = perf_counter()
    with show_progress() as show:

        def progress(done: int, total: int) -> None:
            counts.append(done)
            show(done, total)

        outcomes = carry_out_plan(plan, out, workers=workers, ray=ray, progress=progress)
    # Trials that a broken-off run had finished do not count for the speed.
    rate = (counts[-1] - counts[0]) / (perf_counter() - began)
    summary = summarise(outcomes)
    if as_json:
        print(
            json.dumps(
                {
                    "servo": body.servo.model.name,
                    **summary.as_json(),
                    "trials_per_second": round(rate, 2),
                }
            )
        )
        return
    from miburi.studies.trials.report import in_words

    print(in_words(summary))
    print(f"{rate:.1f} trials/s" + (f"; written to {out}" if out else ""))


def calibrate(
    out: Annotated[Path, typer.Option(help="The calibration file to write.")],
    seed: Seed = 1,
    robot: RobotFile = None,
    servo: ServoName = None,
) -> None:
    """Identify a robot's simulated servos in free moves, and write what they are and need."""
    from miburi.calibration.file import write_calibration
    from miburi.ground.files import whole_files
    from miburi.studies.trials.workshop import calibrate_servos

    body = robot_of(robot, servo)
    done = calibrate_servos(body, seed)
    note = f"Contact rule of {body.name}: servos identified from free moves, seed {seed}."
    with whole_files(out.parent) as draft:
        path = draft / out.name
        write_calibration(done.robot, done.rule, path, note, identified=done.found)
    for line in (*done.words, f"{done.seconds:.0f} s of the robot's time"):
        print(line)
    print(out)


def tune(
    out: Annotated[Path, typer.Option(help="The calibration file to write.")],
    bound: Annotated[
        float, typer.Option(help="Largest allowed share of false stops, 0 to 1.")
    ] = 0.001,
    seed: Seed = 1,
    free: Annotated[int, typer.Option(help="Free runs to record.", min=2)] = 200,
    blocked: Annotated[int, typer.Option(help="Blocked runs to record.", min=1)] = 200,
    robot: RobotFile = None,
    servo: ServoName = None,
) -> None:
    """Search the best period, ratio and guards for a robot's servos, with the project's BMA."""
    from miburi.calibration.file import write_calibration
    from miburi.calibration.free_motion import calibrate as calibrate_traces
    from miburi.ground.files import whole_files
    from miburi.safety.free import FreeRule
    from miburi.safety.printed import PrintedRule
    from miburi.studies.trials.replay import record
    from miburi.studies.trials.tuning import assess, free_traces
    from miburi.studies.trials.tuning import tune as search

    body = robot_of(robot, servo)
    runs = record(body, seed, free, blocked)
    with show_progress() as show:
        found = search(body, runs, bound, seed, lambda tried: show(tried, 150))
    papers = FreeRule.of(body)
    traces = free_traces(papers, [run for run in runs if run.person is None])
    guards = calibrate_traces(traces, body.servo.step, lag=papers.guards.lag)
    papers = replace(papers, guards=guards)
    rows = {
        "found": found.rule,
        "the paper's p and ratio, calibrated": papers,
        "the paper's, as printed": PrintedRule(papers.guards),
    }
    print(f"{found.tried} rules tried on {free} free and {blocked} blocked runs, seed {seed}.")
    for name, rule in rows.items():
        does = assess(rule, runs)
        print(
            f"{name:36}  p {rule.period / 1e6:.2f} s  ratio {rule.ratio / 1e4:.4f}  "
            f"false stops {does.false_stops:.2%}  missed {does.missed:.2%}  "
            f"a person is pushed for {1e3 * does.delay:.0f} ms, with {does.force:.1f} N (median)"
        )
    with whole_files(out.parent) as draft:
        note = (
            f"Contact rule of {body.name}: tuned on {free} free and {blocked} blocked runs, "
            f"seed {seed},\nwith at most {bound:.2%} false stops."
        )
        write_calibration(body, found.rule, draft / out.name, note)
    print(out)


def safety_page(
    runs: Annotated[list[Path], typer.Argument(help="Files of trials, one for each column.")],
    out: Annotated[Path, typer.Option(help="Folder for safety.md and pictures.")] = Path("docs"),
    recorded: Annotated[
        int, typer.Option(help="Free runs, and blocked runs, that judge the rules.")
    ] = 200,
    seed: Seed = 1,
    robot: RobotFile = None,
) -> None:
    """Write the page on contact safety from files of trials; each file names its column."""
    from miburi.ground.files import whole_files
    from miburi.safety.free import FreeRule
    from miburi.studies.trials.figures import rule_map
    from miburi.studies.trials.replay import record
    from miburi.studies.trials.runs import read_parquet
    from miburi.studies.trials.safety_page import write_page

    outcomes = {path.stem.replace("-", " "): read_parquet(path) for path in runs}
    body = robot_of(robot)
    points = rule_map(record(body, seed, recorded, recorded), FreeRule.of(body))
    with whole_files(out) as draft:
        write_page(outcomes, points, draft)
    print(out / "safety.md")


def _plan(
    body: "Robot",
    repertoire: "Repertoire",
    calibration: Path | None,
    rule_name: str,
    servos: int,
    seed: int,
    free: int,
    blocked: int,
    workers: int,
) -> "Plan":
    from concurrent.futures import ProcessPoolExecutor
    from itertools import repeat

    from miburi.robot.specimens import specimens
    from miburi.safety.free import FreeRule
    from miburi.safety.printed import PrintedRule
    from miburi.studies.trials.replay import DeafRule
    from miburi.studies.trials.runs import Plan, Subject
    from miburi.studies.trials.workshop import calibrate_servos

    others = {"printed": PrintedRule, "off": DeafRule}
    if rule_name not in ("miburi", *others):
        raise InputError(f'--rule must be "miburi", "printed" or "off", got {rule_name!r}.')
    if calibration is not None and servos:
        raise InputError("--servos calibrates each servo itself; leave --calibration out.")
    watched = []
    if servos:
        built = [one.robot for one in specimens(body, seed, servos)]
        with ProcessPoolExecutor(workers) as pool, show_progress("calibrations") as show:
            for done in pool.map(calibrate_servos, repeat(body), repeat(seed), built):
                watched.append(Subject(done.robot, done.rule, done.true))
                show(len(watched), servos)
    else:
        robot, rule = calibrated(body, calibration)
        watched.append(Subject(robot, rule or FreeRule.of(robot)))
    if rule_name in others:
        watched = [one._replace(rule=others[rule_name](one.rule.guards)) for one in watched]
    return Plan(tuple(watched), seed, free, blocked, repertoire)


@contextmanager
def show_progress(what: str = "trials") -> Iterator[Callable[[int, int], None]]:
    """Show the progress of a run on standard error, if it is a terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn

    columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
