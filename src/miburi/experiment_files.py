"""The experiment's results as files: JSON, a figure, a film and a recording."""

import json
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from miburi import experiment
from miburi.figures import experiment_figure
from miburi.files import whole_files
from miburi.film import Scene, write_film
from miburi.recording import Recorder
from miburi.robot import iphonoid


def write_experiment(seed: int, seconds: float, out: Path, *, film: bool, hand: bool) -> list[str]:
    """Run the experiment and write its files, all of them or none.

    Parameters
    ----------
    seed, seconds, hand
        As for :func:`miburi.experiment.run`.
    out
        Folder for ``experiment.json``, ``timing.json``, ``experiment.png``,
        ``experiment.mcap`` and, if wished for, ``experiment.mp4``.
    film
        Whether to draw the film.

    Returns
    -------
    What happened, in lines for people.

    Raises
    ------
    InputError
        The seed or the length is not allowed.
    OutputError
        The folder cannot be written to, or this machine cannot draw.
    """
    robot = iphonoid()
    bars = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
    with whole_files(out) as draft, Progress(*bars, console=Console(stderr=True)) as progress:
        progress.console.print(f"seed {seed}, {seconds:g} s of the robot's time")
        running = progress.add_task("experiment", total=seconds)
        with (draft / "experiment.mcap").open("wb") as file, Recorder(file) as recorder:
            result = experiment.run(
                seed,
                seconds,
                hand=hand,
                recorder=recorder,
                progress=lambda time: progress.update(running, completed=time),
            )
        _write_json(draft / "experiment.json", result.report())
        _write_json(draft / "timing.json", result.timing())
        experiment_figure(result, draft / "experiment.png")
        if film:
            scenes = [Scene(frame.angles, frame.hand, _caption(frame)) for frame in result.frames]
            drawing = progress.add_task("film", total=len(scenes))
            write_film(
                robot,
                scenes,
                draft / "experiment",
                progress=lambda done: progress.update(drawing, completed=done),
            )
        names = sorted(file.name for file in draft.iterdir())
    return [*_summary(result), f"written to {out}: {', '.join(names)}"]


def _summary(result: experiment.Experiment) -> list[str]:
    lines = [f"{len(result.gestures)} gestures, {len(result.stops)} contact stops:"]
    lines += [
        f"  {stop.time:6.2f} s  {stop.motor} ({stop.sign})  "
        + (f"{1e3 * stop.latency:.0f} ms after contact, " if stop.latency is not None else "")
        + f"{stop.peak_force:.1f} N, mood {stop.mood_before:.2f} → {stop.mood_after:.2f}"
        for stop in result.stops
    ]
    timing = result.timing()
    lines.append(
        f"false stops: {result.false_stops}, missed contacts: {len(result.missed)}; "
        f"inverse kinematics: median {timing['ik_median_ms']:.3g} ms; "
        f"{timing['real_time_factor']:.0f} × faster than real time"
    )
    return lines


def _caption(frame: experiment.Frame) -> str:
    return f"{frame.feeling}   mood {frame.mood:.2f}\n{frame.phase}   {frame.time:.1f} s"


def _write_json(path: Path, values: object) -> None:
    path.write_text(json.dumps(values, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
