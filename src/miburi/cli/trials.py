"""``miburi trials``, ``calibrate``, ``tune``, ``safety-page``: parse the arguments, call, print."""

import json
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from math import isfinite, radians
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
    command_line,
    repertoire_of,
    robot_of,
)
from miburi.cli.places import a_file, a_folder, must_not_replace, must_replace_calibration
from miburi.errors import BodyError, InputError, need
from miburi.ground.cores import available_cores

if TYPE_CHECKING:
    from miburi.robot import Robot
    from miburi.studies.trials.plan import Subject
    from miburi.studies.trials.trial import Outcome
    from miburi.studies.trials.workshop import Calibrated

#: The most trials of one kind in a run (our choice): a week on eight cores.
_MOST = 10_000_000


Workers = Annotated[
    int | None, typer.Option(help="Processes on this machine; default: one for each core.", min=1)
]
Seed = Annotated[int, typer.Option(help="0 or more.", min=0)]


def trials(
    context: typer.Context,
    free: Annotated[
        int, typer.Option(help="Trials with nobody in the way.", min=0, max=_MOST)
    ] = 1000,
    blocked: Annotated[
        int, typer.Option(help="Trials with somebody in the way.", min=0, max=_MOST)
    ] = 1000,
    seed: Seed = 1,
    workers: Workers = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Parquet file to write, a row for each trial.", callback=a_file),
    ] = None,
    servos: Annotated[
        int,
        typer.Option(
            help="0 simulates the robot as described; N, that many robots that differ as real "
            "ones do, in servos and masses, each calibrated.",
            min=0,
        ),
    ] = 0,
    play: Annotated[
        float | None,
        typer.Option(
            help="With --servos: the play of all their gears, in degrees; by default, each gear "
            "has its own, up to 0.5.",
            min=0.0,
            max=2.0,
        ),
    ] = None,
    rule: Annotated[
        str,
        typer.Option(
            help="The contact rule. miburi: Miburi's own; weightless: that without gravity loads; "
            "profile: compare with the delayed profile; printed: the paper's; off: none, to see "
            "what limiting the motors' force does alone."
        ),
    ] = "miburi",
    without: Annotated[
        str | None,
        typer.Option(
            help="Switch off the 'lift', which raises goals so that weight does not make joints "
            "sag, or the 'ceiling', which limits the motors' force."
        ),
    ] = None,
    state: Annotated[
        str | None,
        typer.Option(help="The calibrated servos' state: hot, warmed-up, worn, 4.75V or 5.25V."),
    ] = None,
    calibration: CalibrationFile = None,
    ray: Annotated[str | None, typer.Option(help="Address of a Ray cluster to use.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Answer as JSON.")] = False,
    robot: RobotFile = None,
    servo: ServoName = None,
    gestures: GesturesFolder = None,
) -> None:
    """Put simulated people in the robot's way, and count what the contact rule does."""
    need("scipy", "studies")
    if out is not None:
        need("pyarrow", "studies")
        if out.suffix != ".parquet":
            raise InputError(f"--out must end in .parquet, such as trials.parquet; got {out}.")
    must_not_replace(out, robot, servo, calibration)
    if ray is not None:
        need("ray", "cluster")
    from miburi.robot.specimens import specimens
    from miburi.studies.provenance import provenance
    from miburi.studies.trials.plan import Plan
    from miburi.studies.trials.runs import carry_out_plan
    from miburi.studies.trials.summary import summarise

    workers = workers or available_cores()
    body = robot_of(robot, servo)
    repertoire = repertoire_of(body, gestures)
    if play is not None and not isfinite(play):
        raise InputError(f"--play must be 0 to 2 degrees, got {play}.")
    if play is not None and not servos:
        raise InputError(f"--play {play:g} needs --servos: it is the play of their gears.")
    angle = None if play is None else radians(play)
    built = [one.robot for one in specimens(body, seed, servos, angle)]
    watched = _subjects(body, calibration, rule, without, state, built, seed, workers)
    chosen = {"rule": rule, "servo": body.servo.model.name, "servos": servos, "without": without}
    chosen |= {"state": state, "play": play, "robot": body.name}
    files = {"robot": robot, "gestures": gestures, "calibration": calibration}
    chosen |= {name: file.name for name, file in files.items() if file}
    chosen |= {"command": command_line(context)}
    chosen |= provenance(robot=body, repertoire=repertoire, calibration=calibration)
    chosen = {name: value for name, value in chosen.items() if value is not None}
    told = {name: str(value) for name, value in chosen.items()}
    plan = Plan(tuple(watched), seed, free, blocked, repertoire, told)
    counts: list[int] = []
    began = perf_counter()
    with _resumable(out, counts), show_progress() as show:

        def progress(done: int, total: int) -> None:
            counts.append(done)
            show(done, total)

        outcomes = carry_out_plan(plan, out, workers=workers, ray=ray, progress=progress)
    # Trials that an interrupted run had finished before do not count towards the speed.
    rate = (counts[-1] - counts[0]) / (perf_counter() - began)
    summary = summarise(outcomes)
    if as_json:
        drawn = {"robots": len(built), "left_out": len(built) - len(watched)} if built else {}
        speed = {"trials_per_second": round(rate, 2)}
        print(json.dumps({"seed": seed, **chosen, **drawn, **summary.as_json(), **speed}))
        return
    from miburi.studies.trials.tables import in_words

    print(in_words(summary))
    before = f", with {counts[0]} trials of an interrupted run" if counts[0] else ""
    print(f"{rate:.1f} trials/s" + (f"; written to {out}{before}" if out else ""))


def calibrate(
    out: Annotated[Path, typer.Option(help="The calibration file to write.", callback=a_file)],
    seed: Seed = 1,
    robot: RobotFile = None,
    servo: ServoName = None,
) -> None:
    """Estimate simulated servos' constants and guards from moves without contact; write them."""
    from miburi.calibration.file import write_calibration
    from miburi.ground.files import whole_files
    from miburi.studies.trials.workshop import calibrate_servos

    must_replace_calibration(out)
    body = robot_of(robot, servo)
    print("Moving every simulated joint freely; this takes about ten seconds.", file=sys.stderr)
    done = calibrate_servos(body, seed)
    note = f"Contact rule of {body.name}: servos identified from free moves, seed {seed}."
    with whole_files(out.parent) as draft:
        path = draft / out.name
        write_calibration(done.robot, done.rule, path, note, identified=done.found, of=body)
    for line in (*done.words, f"{done.seconds:.0f} s of the robot's time"):
        print(line)
    print(out)


def tune(
    out: Annotated[Path, typer.Option(help="The calibration file to write.", callback=a_file)],
    bound: Annotated[
        float, typer.Option(help="Largest allowed share of false stops.", min=0, max=1)
    ] = 0.001,
    seed: Seed = 1,
    free: Annotated[int, typer.Option(help="Free runs to record.", min=2)] = 200,
    blocked: Annotated[int, typer.Option(help="Blocked runs to record.", min=1)] = 200,
    robot: RobotFile = None,
    servo: ServoName = None,
    gestures: GesturesFolder = None,
) -> None:
    """Search for a robot's best period, ratio and guards with the Bacterial Memetic Algorithm.

    The rule is judged on fresh runs, with the next seed. Unlike a calibration, it may narrow
    guards.
    """
    need("scipy", "studies")
    from miburi.calibration.file import write_calibration
    from miburi.calibration.free_motion import calibrate as calibrate_traces
    from miburi.ground.files import whole_files
    from miburi.safety.free import FreeRule
    from miburi.safety.printed import PrintedRule
    from miburi.studies.trials.replay import record
    from miburi.studies.trials.summary import what_is_shown, wilson
    from miburi.studies.trials.tuning import assess, free_traces
    from miburi.studies.trials.tuning import tune as search

    must_replace_calibration(out)
    body = robot_of(robot, servo)
    repertoire = repertoire_of(body, gestures)
    runs = record(body, seed, free, blocked, repertoire)
    with show_progress() as show:
        found = search(body, runs, bound, seed, lambda tried: show(tried, 150))
    own = papers = FreeRule.of(body)
    traces = free_traces(papers, [run for run in runs if run.person is None])
    guards = calibrate_traces(traces, body.servo.step, lag=papers.guards.lag)
    papers = replace(papers, guards=guards)
    rows = {
        "found": found.rule,
        "the description's": own,
        "the paper's p and ratio, calibrated": papers,
        "the paper's, as printed": PrintedRule(papers.guards),
    }
    print(
        f"{found.tried} rules tried on {free} free and {blocked} blocked runs, seed {seed}; judged "
        f"on as many fresh ones, seed {seed + 1} (in brackets: 95 % intervals)."
    )
    fresh = record(body, seed + 1, free, blocked, repertoire)

    def share(value: float, of: int) -> str:
        low, high = wilson(round(value * of), of)
        return f"{value:.2%} ({100 * low:.2f} to {100 * high:.2f} %)"

    verdicts = {name: assess(rule, fresh) for name, rule in rows.items()}
    for name, does in verdicts.items():
        rule = rows[name]
        print(
            f"{name:36}  p {rule.period / 1e6:.2f} s  ratio {rule.ratio / 1e4:.4f}  "
            f"false stops {share(does.false_stops, does.runs)}  "
            f"missed {share(does.missed, does.touched)}  "
            f"a person is pushed for {1e3 * does.delay:.0f} ms, with {does.force:.1f} N (median)"
        )
    does = verdicts["found"]
    shown = what_is_shown(bound, round(does.false_stops * does.runs), does.runs)
    print(shown)
    if does.false_stops > verdicts["the description's"].false_stops:
        print("The description's rule had fewer false stops: keep it, or tune on more runs.")
    with whole_files(out.parent) as draft:
        note = (
            f"Contact rule of {body.name}: tuned on {free} free and {blocked} blocked runs, "
            f"seed {seed}.\nFalse stops on as many fresh runs, seed {seed + 1}: "
            f"{share(does.false_stops, does.runs)}.\n{shown}"
        )
        write_calibration(body, found.rule, draft / out.name, note)
    print(out)


def safety_page(
    runs: Annotated[
        list[Path],
        typer.Argument(
            help="Files of trials, one for each column; those in folders named 'states' and "
            "'parts' have tables of their own."
        ),
    ],
    out: Annotated[
        Path, typer.Option(help="Folder for safety.md and pictures.", callback=a_folder)
    ] = Path("docs"),
    recorded: Annotated[
        int, typer.Option(help="Number of free runs, and of blocked runs, to judge the rules by.")
    ] = 200,
    seed: Seed = 1,
    robot: RobotFile = None,
) -> None:
    """Write the page on contact safety from files of trials; file names become column headings."""
    from collections import defaultdict

    from miburi.ground.files import whole_files
    from miburi.safety.free import FreeRule
    from miburi.studies.trials.charts import rule_map
    from miburi.studies.trials.replay import record
    from miburi.studies.trials.runs import read_parquet
    from miburi.studies.trials.safety_page import write_page

    tables: dict[str, dict[str, list[Outcome]]] = defaultdict(dict)
    for path in runs:
        table = path.parent.name if path.parent.name in ("states", "parts") else "main"
        tables[table][path.stem.replace("-", " ")] = read_parquet(path)
    body = robot_of(robot)
    points = rule_map(record(body, seed, recorded, recorded), FreeRule.of(body))
    with whole_files(out) as draft:
        write_page(tables, points, draft)
    print(out / "safety.md")


def _subjects(
    body: "Robot",
    calibration: Path | None,
    rule: str,
    without: str | None,
    state: str | None,
    built: list["Robot"],
    seed: int,
    workers: int,
) -> list["Subject"]:
    from miburi.safety.free import FreeRule
    from miburi.studies.trials.ablation import RULES, STATES, WITHOUT, in_state
    from miburi.studies.trials.plan import Subject
    from miburi.studies.trials.workshop import driven

    for option, given, allowed in (
        ("--rule", rule, RULES),
        ("--without", without, WITHOUT),
        ("--state", state, STATES),
    ):
        if given is not None and given not in allowed:
            names = ", ".join(f'"{name}"' for name in allowed)
            raise InputError(f"{option} must be one of {names}, got {given!r}.")
    if calibration is not None and rule in ("profile", "printed", "off"):
        raise InputError(
            f"--rule {rule} does not use the rule in the file of --calibration; leave out one of "
            "them."
        )
    if sum((calibration is not None, bool(built), state is not None)) > 1:
        raise InputError(
            "--servos and --state calibrate each servo themselves; give one of them, or "
            "--calibration."
        )
    if without is not None:
        body = driven(body, **WITHOUT[without])
    watched, judged = list[Subject](), RULES[rule]
    if built:
        for done in _calibrations(body, seed, built, workers):
            watched.append(Subject(done.robot, judged(done.rule), done.true))
    elif state is not None:
        watched.append(in_state(body, state, seed, judged))
    else:
        robot, own = calibrated(body, calibration)
        watched.append(Subject(robot, judged(own or FreeRule.of(robot))))
    return watched


def _calibrations(
    body: "Robot", seed: int, built: list["Robot"], workers: int
) -> list["Calibrated"]:
    """Calibrate robots; leave out those that fail, and name them on standard error."""
    from miburi.studies.trials.workshop import calibrate_servos

    calibrations, refused = list["Calibrated"](), list[str]()
    with ProcessPoolExecutor(workers) as pool, show_progress("calibrations") as show:
        each = [pool.submit(calibrate_servos, body, seed, true) for true in built]
        for number, one in enumerate(each, 1):
            try:
                calibrations.append(one.result())
            except BodyError as error:
                refused.append(f"Robot {number} of {len(built)} is left out. {error}")
            except BaseException:
                pool.shutdown(cancel_futures=True)
                raise
            show(number, len(built))
    if not calibrations:
        raise BodyError(f"None of the robots could be calibrated. {refused[0]}")
    for words in refused:
        print(f"miburi: {words}", file=sys.stderr)
    return calibrations


@contextmanager
def _resumable(out: Path | None, counts: list[int]) -> Iterator[None]:
    """Say that an interrupted run of trials, which were counted, can go on."""
    try:
        yield
    except BaseException:
        if out is not None and counts and counts[-1]:
            print(
                f"miburi: {counts[-1]} trials are kept; the same command goes on from there.",
                file=sys.stderr,
            )
        raise


@contextmanager
def show_progress(what: str = "trials") -> Iterator[Callable[[int, int], None]]:
    """Show the progress of a run on standard error, if it is a terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn

    columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
