"""Conduct the experiment and write its results: JSON, a figure, a film and a recording."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from miburi.bodies import Body
from miburi.feelings import Expression
from miburi.ground.files import whole_files
from miburi.live.recording.recorder import Recorder, RecordingAbout
from miburi.robot import EXTREMITIES, Robot
from miburi.studies import experiment
from miburi.studies import face as faces
from miburi.studies.experiment.chart import experiment_figure
from miburi.studies.film import DrawingError, Scene, add_caption, camera, contact_sheet, write_film

#: The files that a run may write.
_FILES = (
    "experiment.json", "timing.json", "experiment.png", "experiment.mcap",
    "experiment.mp4", "experiment.sheet.png", "experiment-strip.png",
)  # fmt: skip


def write_experiment(
    body: Body, setup: experiment.Setup, out: Path, *, film: bool, face: bool
) -> list[str]:
    """Conduct the experiment, write its files, and return the lines of a summary.

    The files are ``experiment.json``, ``timing.json``, ``experiment.png`` and ``experiment.mcap``,
    all or none; then, with ``film``, ``experiment.mp4`` and ``experiment-strip.png``, both or none.
    If the machine cannot draw, film and strip are left out, and the summary says so. An earlier
    run's files are deleted once this run has results. With ``face``, film and strip show the face
    on the phone.

    Raises OutputError if the folder cannot be written to, or ffmpeg fails.
    """
    bars = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
    left_out = []
    with Progress(*bars, console=Console(stderr=True)) as progress:
        with whole_files(out) as draft:
            result = _conduct(body, setup, draft, progress)
            for earlier in _FILES:
                (out / earlier).unlink(missing_ok=True)
            names = sorted(file.name for file in draft.iterdir())
        if film:
            try:
                with whole_files(out) as draft:
                    _film(body.robot, result, draft, progress, face=face)
                    names = sorted([*names, *(file.name for file in draft.iterdir())])
            except DrawingError as error:
                left_out = [f"The film is left out: {error}"]
            except BaseException:
                print(
                    f"miburi: the film was not finished; the other files are in {out}.",
                    file=sys.stderr,
                )
                raise
    return [*_summary(result), f"written to {out}: {', '.join(names)}", *left_out]


def _conduct(
    body: Body, setup: experiment.Setup, folder: Path, progress: Progress
) -> experiment.Experiment:
    progress.console.print(f"seed {setup.seed}, {setup.seconds:g} s of the robot's time")
    running = progress.add_task("experiment", total=setup.seconds)
    chosen = {name: value for name, value in setup.chosen.items() if value is not None}
    metadata = {
        **chosen,
        "robot": body.robot.name,  # not its file's name
        "temperament": setup.temperament.name,
        "seed": str(setup.seed),
        "servo": body.robot.servo.model.name,
        "clock": "the robot's, from 0",
    }
    about = RecordingAbout(body.robot, metadata)
    with (folder / "experiment.mcap").open("wb") as file, Recorder(file, about) as recorder:
        result = experiment.conduct(
            body,
            setup,
            recorder=recorder,
            progress=lambda time: progress.update(running, completed=time),
        )
    _write_json(folder / "experiment.json", result.report())
    _write_json(folder / "timing.json", result.timing())
    experiment_figure(result, folder / "experiment.png")
    return result


def _film(
    robot: Robot, result: experiment.Experiment, folder: Path, progress: Progress, *, face: bool
) -> None:
    scenes = [_scene(frame, face=face) for frame in result.frames]
    _write_strip(robot, result, scenes, folder / "experiment-strip.png")
    drawing = progress.add_task("film", total=len(scenes))
    write_film(
        robot,
        scenes,
        folder / "experiment",
        rate=1 / (experiment.STEP * experiment.STEPS_PER_FRAME),
        progress=lambda done: progress.update(drawing, completed=done),
    )


def _summary(result: experiment.Experiment) -> list[str]:
    stops = f"{len(result.stops)} contact stop{'s' * (len(result.stops) != 1)}"
    lines = [f"{result.servo}: {len(result.gestures)} gestures, {stops}:"]
    lines += [
        f"  {stop.time:6.2f} s  {stop.motor} ({stop.sign})  "
        + (f"{1e3 * stop.latency:.0f} ms after contact, " if stop.latency is not None else "")
        + f"{stop.peak_force:.1f} N, mood {stop.mood_before:.2f} → {stop.mood_after:.2f}"
        for stop in result.stops
    ]
    timing, solved = result.timing(), result.solutions
    if result.too_long:
        longest = max(gesture.end - gesture.start for gesture in result.too_long)
        lines.append(
            f"{len(result.too_long)} gestures did not fit into {result.setup.period:g} s (the "
            f"longest took {longest:.2f} s): no gesture starts at the multiples of "
            "the period that fall within them"
        )
    if result.healing is not None:
        healed = result.healing
        lines.append(f"healing, in the partner's own time (constant {healed.time_constant:g} s):")
        lines += [
            f"  after {time:6.0f} s  mood {mood:.3f}, an untouched twin's {untouched:.3f}"
            for time, mood, untouched in zip(
                healed.times, healed.moods, healed.untouched, strict=True
            )
        ]
    if result.setup.settings is not None and solved:
        errors = 1e3 * np.array([solution.error for solution in solved])
        worst = ", ".join(
            f"{name} {median:.2f} ({largest:.2f})"
            for name, median, largest in zip(
                EXTREMITIES, np.median(errors, axis=0), errors.max(axis=0), strict=True
            )
        )
        lines.append(
            f"{len(solved)} solves, {sum(s.generations for s in solved)} generations; off by "
            f"{worst} mm, median (largest)"
        )
    touched = result.missed or any(stop.contact_time is not None for stop in result.stops)
    if not touched:
        lines.append("nothing was touched: there was no contact to notice or to miss")
    missed = f", missed contacts: {len(result.missed)}" if touched else ""
    lines.append(
        f"false stops: {result.false_stops}{missed}; "
        f"inverse kinematics: median {timing['ik_median_ms']:.3g} ms; "
        f"{timing['real_time_factor']:.0f} × faster than real time"
    )
    return lines


def _write_strip(
    robot: Robot, result: experiment.Experiment, scenes: list[Scene], path: Path
) -> None:
    stop = result.stops[0].time if result.stops else result.times[-1] / 2
    moments = [stop - 1.2, stop - 0.15, stop + 0.25, stop + 1.9, stop + 3.2, stop + 4.2]
    with camera(robot, 960, 720) as opened:
        pictures = []
        for moment in moments:
            index = min(range(len(scenes)), key=lambda i: abs(result.frames[i].time - moment))
            plain = replace(scenes[index], caption="")
            upright = opened.picture(plain)[40:700, 110:850]
            pictures.append(add_caption(upright, scenes[index].caption))
    Image.fromarray(contact_sheet(pictures, 3)).save(path)


def _scene(frame: experiment.FilmFrame, *, face: bool) -> Scene:
    shown = Expression(frame.feeling, frame.mood) if frame.feeling else None
    caption = f"{frame.feeling}   mood {frame.mood:.2f}\n{frame.phase}   {frame.time:.1f} s"
    return Scene(frame.angles, frame.hand, caption, faces.face(shown) if face else None)


def _write_json(path: Path, values: object) -> None:
    path.write_text(json.dumps(values, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
