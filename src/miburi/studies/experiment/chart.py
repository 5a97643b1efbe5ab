"""Draw the experiment's result as a figure for print."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from miburi.safety.contact import PAPER_RATIO
from miburi.studies.experiment.procedure import STEP, Experiment
from miburi.studies.experiment.records import Healing, StopRecord, WindowRecord
from miburi.studies.figures import BLUE, CORAL, GREY, INK, PRINT, figure_file

#: The number of stops drawn close up.
_CLOSE_UPS = 4


def experiment_figure(result: Experiment, path: Path) -> None:
    """Draw curves of mood, hand speed, extent and contact stops; below, the first stops close up.

    The hand speed is the mean of both hands, smoothed over 0.1 s.
    """
    with figure_file(path, (7.2, 8.8), PRINT, dpi=150) as figure:
        course, close = figure.subfigures(2, 1, squeeze=False, height_ratios=[3, 1.8])[:, 0]
        mood, speed, extent = course.subplots(3, 1, sharex=True)
        _draw_course(result, mood, speed, extent)
        stops = list(zip(result.stops, result.approaches, strict=True))[:_CLOSE_UPS]
        count = len(stops) + (result.healing is not None)
        grid = close.add_gridspec(2, max(1, count), height_ratios=[1.4, 1])
        for column, (stop, approach) in enumerate(stops):
            panels = [close.add_subplot(grid[row, column]) for row in (0, 1)]
            _draw_stop(stop, approach, *panels, first=column == 0)
        if result.healing is not None:
            _draw_healing(result.healing, close.add_subplot(grid[:, -1]))
        _say_what_it_is(figure, result)


def _draw_course(result: Experiment, mood: Axes, speed: Axes, extent: Axes) -> None:
    times, end = np.array(result.times), result.times[-1]
    mood.plot(times, result.moods, color=INK)
    mood.set(ylabel="mood μ", ylim=(0, 1.05))
    for stop in result.stops:
        near_end = stop.time > 0.8 * end
        mood.annotate(
            (stop.motor or stop.sign or "stop").replace("_", " "),
            (stop.time, stop.mood_after),
            (-4 if near_end else 4, -10 if near_end else 10),
            ha="right" if near_end else "left",
            textcoords="offset points",
            fontsize=8,
            color=CORAL,
        )
    hands = np.array(result.hands).reshape(len(times), 2, 3)
    span = round(0.1 / STEP)
    moved = np.linalg.norm(np.diff(hands, axis=0), axis=2).mean(axis=1) / STEP
    smooth = np.convolve(moved, np.ones(span) / span, mode="same")
    speed.plot(times[1:], smooth, color=BLUE, linewidth=0.9)
    speed.set(ylabel="hand speed (m/s)", ylim=(0, None))
    for number, gesture in enumerate(result.gestures, start=1):
        middle = (gesture.start + gesture.end) / 2
        extent.bar(
            middle,
            1e3 * gesture.extent,
            width=gesture.end - gesture.start,
            color=BLUE if gesture.complete else "white",
            edgecolor=BLUE if gesture.complete else GREY,
            hatch=None if gesture.complete else "///",
            linewidth=0.6,
        )
        if len(result.gestures) <= 30:  # more numbers would be illegible
            extent.annotate(
                str(number),
                (middle, 1e3 * gesture.extent),
                (0, 2),
                ha="center",
                textcoords="offset points",
                fontsize=7,
                color=INK,
            )
    extent.set(ylabel="extent (mm)", xlabel="time (s)", xlim=(0, end))
    extent.margins(y=0.15)
    for axis in (mood, speed, extent):
        for stop in result.stops:
            axis.axvline(stop.time, color=CORAL, linewidth=0.9, linestyle="--")


def _draw_stop(
    stop: StopRecord, near: list[WindowRecord], axes: Axes, ratio: Axes, *, first: bool
) -> None:
    times = [1e3 * (window.time - stop.time) for window in near]
    axes.plot(times, [w.commanded for w in near], color=GREY, label="commanded")
    axes.plot(times, [w.measured for w in near], color=BLUE, label="measured")
    axes.set(ylim=(min(0, axes.get_ylim()[0]), 1.35 * axes.get_ylim()[1]), xticklabels=[])
    ratio.plot(times, [min(w.ratio, 1.5) for w in near], color=INK, linewidth=0.9)
    ratio.axhline(PAPER_RATIO / 10_000, color=INK, linewidth=0.5)
    ratio.set(ylim=(0.4, 1.55), xlabel="ms from the stop")
    for panel in (axes, ratio):
        panel.set(xlim=(-400, 50))
        panel.axvline(0, color=CORAL, linewidth=0.9, linestyle="--")
        if stop.contact_time is not None:
            touched = 1e3 * (stop.contact_time - stop.time)
            panel.axvline(touched, color=CORAL, linewidth=0.9, linestyle=":")
    title = (
        f"{(stop.motor or '').replace('_', ' ')}\n{stop.time:.2f} s, by {stop.sign or 'no sign'}"
    )
    axes.set_title(title, fontsize=8)
    if first:
        axes.set_ylabel("speed (rad/s)")
        ratio.set_ylabel("ratio\n(limit 0.94)")
        axes.legend(fontsize=7, loc="upper left", frameon=False, borderpad=0, labelspacing=0.2)


def _draw_healing(healing: Healing, axes: Axes) -> None:
    minutes = np.array(healing.times) / 60
    axes.plot(minutes, healing.untouched, color=GREY, label="untouched twin")
    axes.plot(minutes, healing.moods, color=INK, label="touched")
    axes.legend(fontsize=7, loc="lower right", frameon=False, borderpad=0)
    axes.set(xlabel="min after the gestures", ylim=(0, 1.05))
    axes.set_title("the mood heals", fontsize=8)


def _say_what_it_is(figure: Figure, result: Experiment) -> None:
    at = result.setup
    figure.suptitle(
        f"{at.feeling.capitalize()} at μ = {at.mood:g}, a gesture every {at.period:g} s, seed "
        f"{at.seed}. Dashed: contact stop, with the motor that met the hand.\n"
        "Extent: farthest a hand went in a gesture; hatched: broken off. Below: the first "
        "stops;\ndotted: first touch. By speed: the ratio crosses its limit; by tracking: the "
        "motor lags\nfarther behind its course than a free servo does.",
        fontsize=9,
        x=0.01,
        ha="left",
    )
