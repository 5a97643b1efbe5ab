"""Figures of results, readable in print."""

from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")

import matplotlib.pyplot as plt

from miburi.studies.experiment.procedure import STEP, Experiment

__all__ = ["experiment_figure"]

_INK, _CORAL, _BLUE, _GREY = "#2b2b2b", "#d9553f", "#2f6f9f", "#9a9a9a"


def experiment_figure(result: Experiment, path: Path) -> None:
    """Draw the experiment: mood, hand speed and extent over time, and where the body stopped.

    The hand speed is the mean of both hands' over 0.1 s.
    """
    with plt.rc_context({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False}):
        figure, (mood, speed, extent) = plt.subplots(
            3, 1, figsize=(7.2, 5.6), sharex=True, layout="constrained"
        )
        times = np.array(result.times)
        mood.plot(times, result.moods, color=_INK)
        mood.set(ylabel="mood μ", ylim=(0, 1.05))
        for stop in result.stops:
            mood.annotate(
                f"{(stop.motor or stop.sign or 'stop').replace('_', ' ')}",
                (stop.time, stop.mood_after),
                (4, 10),
                textcoords="offset points",
                fontsize=8,
                color=_CORAL,
            )
        hands = np.array(result.hands).reshape(len(times), 2, 3)
        span = round(0.1 / STEP)
        moved = np.linalg.norm(np.diff(hands, axis=0), axis=2).mean(axis=1) / STEP
        smooth = np.convolve(moved, np.ones(span) / span, mode="same")
        speed.plot(times[1:], smooth, color=_BLUE, linewidth=0.9)
        speed.set(ylabel="hand speed (m/s)", ylim=(0, None))
        for gesture in result.gestures:
            extent.barh(
                1e3 * gesture.extent / 2,
                gesture.end - gesture.start,
                height=1e3 * gesture.extent,
                left=gesture.start,
                color=_BLUE if gesture.complete else "white",
                edgecolor=_BLUE if gesture.complete else _GREY,
                hatch=None if gesture.complete else "///",
                linewidth=0.6,
            )
        extent.set(ylabel="extent (mm)", xlabel="time (s)", xlim=(0, times[-1]))
        for axis in (mood, speed, extent):
            for stop in result.stops:
                axis.axvline(stop.time, color=_CORAL, linewidth=0.9, linestyle="--")
        figure.suptitle(
            f"Happiness at μ = 0.9, a gesture each 2 s, seed {result.seed}. "
            "Dashed: contact stop, with the motor that met the hand.\n"
            "Extent: farthest that a hand went in a gesture; hatched: broken off.",
            fontsize=9,
            x=0.01,
            ha="left",
        )
        figure.savefig(path, dpi=150, metadata={"Software": "miburi"})
        plt.close(figure)
