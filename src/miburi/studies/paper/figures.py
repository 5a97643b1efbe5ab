"""Draw the paper's figures anew, from the running code."""

from collections import Counter
from itertools import pairwise
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from miburi import ik
from miburi.bodies import Body
from miburi.feelings import FEELINGS
from miburi.gestures import key_poses, load, membership
from miburi.partner import Event, Partner
from miburi.robot import Robot, forward
from miburi.studies.day import COLOURS
from miburi.studies.experiment import Setup
from miburi.studies.paper.denavit import TABLES, frames
from miburi.studies.paper.rule import FIRST_WINDOW, pass_map

__all__ = ["dh_figure", "effort_figure", "flow_figure", "function_figure", "rule_figure"]
__all__ += ["safety_figure"]

_INK, _CORAL, _GREY = "#2b2b2b", "#d9553f", "#9a9a9a"
_AXES = ("#c3202f", "#3d8b37", "#2f6f9f")


def _save(figure: Figure, path: Path) -> None:
    figure.savefig(path, dpi=130, metadata={"Software": None})


def safety_figure(path: Path) -> None:
    """Draw the flow of the blocking feature (Fig. 1)."""
    steps = (
        "the host sends final positions and speeds",
        "the card orders each motor to its place",
        "at each reading: every motor's travel",
        "is one motor slower than\n0.9372 of what is due?",
        "stop all motors, give way,\nhold softly",
    )
    figure = Figure(figsize=(4.6, 5.2), layout="constrained")
    axes = figure.subplots()
    axes.axis("off")
    axes.set(xlim=(0, 10), ylim=(-0.7, 10))
    box = {"boxstyle": "round,pad=0.5", "facecolor": "#f6efe6", "edgecolor": _INK}
    heights = [9.4 - 2.3 * k for k in range(len(steps))]
    for height, words in zip(heights, steps, strict=True):
        axes.text(5, height, words, ha="center", va="center", fontsize=9, bbox=box)
    arrow = {"arrowstyle": "->", "color": _INK}
    for (above, below), word in zip(pairwise(heights), ("", "", "", "yes"), strict=True):
        axes.annotate("", (5, below + 0.6), (5, above - 0.6), arrowprops=arrow)
        axes.text(5.2, (above + below) / 2, word, fontsize=9, color=_CORAL, va="center")
    bent = arrow | {"connectionstyle": "arc3,rad=-0.8"}
    axes.annotate("", (8.2, heights[2]), (8.2, heights[3]), arrowprops=bent | {
        "connectionstyle": "arc3,rad=0.8"})  # fmt: skip
    axes.text(9.4, (heights[2] + heights[3]) / 2, "no", fontsize=9, ha="center", va="center")
    _save(figure, path)


def dh_figure(robot: Robot, path: Path) -> None:
    """Draw the frames of the three chains at neutral (Figs. 2 and 3): x red, y green, z blue."""
    figure = Figure(figsize=(6.6, 4.6), layout="constrained")
    views = (("from the front", 1), ("from the robot's left", 0))
    for axes, (title, across) in zip(figure.subplots(1, 2, sharey=True), views, strict=True):
        for extremity in TABLES:
            chain = frames(robot, extremity, robot.neutral)
            axes.plot(chain[:, across, 3], chain[:, 2, 3], color=_GREY, lw=3)
            for frame in chain:
                for column, colour in enumerate(_AXES):
                    start, along = frame[[across, 2], 3], 0.022 * frame[[across, 2], column]
                    axes.annotate(
                        "", start + along, start, arrowprops={"arrowstyle": "->", "color": colour}
                    )
            axes.text(chain[-1][across, 3], chain[-1][2, 3] - 0.03, extremity, fontsize=8)
        axes.set(aspect="equal", xlabel=f"{'xy'[across]} (m)")
        axes.set_title(title, fontsize=8)
        axes.margins(0.25)
    _save(figure, path)


def effort_figure(path: Path) -> None:
    """Draw Laban's effort of each gesture at full intensity (Fig. 5)."""
    names = ("space", "weight", "time", "flow")
    ends = ("indirect – direct", "light – strong", "sustained – sudden", "bound – free")
    figure = Figure(figsize=(7, 2.8), layout="constrained")
    axes = figure.subplots()
    for index, (feeling, colour) in enumerate(zip(FEELINGS, COLOURS, strict=True)):
        effort = load(feeling).effort
        heights = [getattr(effort, name) for name in names]
        axes.bar(np.arange(4) + 0.1 * (index - 3.5), heights, width=0.09, color=colour,
                 label=feeling)  # fmt: skip
    axes.set_xticks(range(4), [f"{n}\n{e}" for n, e in zip(names, ends, strict=True)], fontsize=8)
    axes.set(ylim=(0, 1.05))
    figure.legend(fontsize=7, loc="outside right upper", frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    _save(figure, path)


def flow_figure(body: Body, path: Path) -> dict[tuple[str, str], int]:
    """Run a partner, and draw which event followed which (Fig. 6); return the counts.

    The body is touched once: somebody's hand is put in the way of the second gesture.
    """
    setup = Setup(seconds=30.0)
    partner, events = Partner(body, setup.feelings(), period=setup.period), list[Event]()
    touchable = body.touchable
    place = np.array([0.1, -0.13, 0.13])  # in the way of the right arm
    for step in range(round(12 / 0.02)):
        if touchable is not None and step == 105:
            touchable.place_hand(place, np.array([0.0, 1.0, 0.0]))
        if touchable is not None and step == 180:
            touchable.remove_hand()
        events += partner.step(0.02)
    names = [type(event).__name__ for event in events]
    follows = Counter(pairwise(names))
    # So that no arrow crosses another.
    places = {
        "GestureStarted": (0.14, 0.95, "a gesture starts:\nstrongest emotion, mood μ"),
        "MoveSent": (0.86, 0.95, "9 coordinates → 8 angles:\na move is sent"),
        "GestureEnded": (0.5, 0.5, "the gesture ends"),
        "Stopped": (0.86, 0.05, "contact: stop,\nmood × 0.8"),
        "Released": (0.14, 0.05, "released: back\nto neutral"),
    }
    figure = Figure(figsize=(7, 4.2), layout="constrained")
    axes = figure.subplots()
    axes.axis("off")
    axes.set(xlim=(-0.1, 1.1), ylim=(-0.1, 1.15))
    boxes = {
        name: axes.text(x, y, words, ha="center", va="center", fontsize=9,
                        bbox={"boxstyle": "round,pad=0.5", "facecolor": "#f6efe6"})
        for name, (x, y, words) in places.items()
    }  # fmt: skip
    for (before, after), count in sorted(follows.items()):
        (x0, y0, _), (x1, y1, _) = places[before], places[after]
        if before == after:
            axes.text(x0, y0 + 0.14, f"↻ {count} ×", fontsize=9, color=_CORAL, ha="center")
            continue
        axes.annotate(
            "",
            (x1, y1),
            (x0, y0),
            arrowprops={
                "arrowstyle": "-|>",
                "color": _CORAL,
                "shrinkA": 4,
                "shrinkB": 4,
                "patchA": boxes[before].get_bbox_patch(),
                "patchB": boxes[after].get_bbox_patch(),
            },
        )
        axes.text(
            (x0 + x1) / 2,
            (y0 + y1) / 2,
            f"{count} ×",
            fontsize=9,
            color=_CORAL,
            ha="center",
            va="center",
            bbox={"facecolor": "white", "lw": 0, "pad": 2},
        )
    _save(figure, path)
    return dict(follows)


def function_figure(robot: Robot, path: Path) -> None:
    """Draw the memberships and the eight movement functions at three moods (Fig. 7)."""
    figure = Figure(figsize=(9, 4.6), layout="constrained")
    grid = figure.subplots(2, 5)
    panel: Axes = grid[0, 0]
    moods = np.linspace(0, 1, 50)
    for hedge, style in (("more or less", ":"), ("plainly", "-"), ("very", "--")):
        function = load("happiness").model_copy(update={"hedge": hedge})
        shape = [membership(function, float(mood)) for mood in moods]
        panel.plot(moods, shape, style, color=_INK, label=hedge)
    panel.set_title("membership of μ", fontsize=8)
    panel.legend(fontsize=6, frameon=False)
    grid[1, 0].axis("off")
    grid[1, 0].text(0, 0.5, "Hands from the front\nat μ = 0.3, 0.6, 0.9\n(darker: more)\n\n"
                    "Dots: key poses", fontsize=8, va="center")  # fmt: skip
    for index, (feeling, colour) in enumerate(zip(FEELINGS, COLOURS, strict=True)):
        axes = grid[index // 4, 1 + index % 4]
        for mood, alpha in ((0.3, 0.35), (0.6, 0.6), (0.9, 1.0)):
            angles = [robot.neutral]
            for pose in key_poses(robot, load(feeling), mood):
                angles.append(ik.solve(robot, pose.target, start=angles[-1]).angles)
            steps = [a + part * (b - a) for a, b in pairwise(angles)
                     for part in np.linspace(0, 1, 15)]  # fmt: skip
            for hand in (0, 3):
                track, dots = (1e3 * forward(robot, np.array(q)) for q in (steps, angles))
                axes.plot(track[:, hand + 1], track[:, hand + 2], lw=1, color=colour, alpha=alpha)
                axes.plot(dots[:, hand + 1], dots[:, hand + 2], "o", ms=2, color=colour,
                          alpha=alpha)  # fmt: skip
        axes.set(xlim=(-210, 210), ylim=(-40, 270), aspect="equal", xticks=[], yticks=[])
        axes.set_title(feeling, fontsize=8)
    _save(figure, path)


def rule_figure(moves: list[tuple[float, float]], path: Path) -> float:
    """Draw which share of moves the printed rule lets pass, over lag and ramp.

    ``moves`` are (distance rad, speed rad/s) of the fastest motor. Returns the share at the
    imagined servo's 20 ms and 40 rad/s².
    """
    lags = np.linspace(0, 0.04, 41)
    ramps = np.geomspace(20, 4000, 47)
    passes = pass_map(moves, lags, ramps)
    figure = Figure(figsize=(5.6, 3.6), layout="constrained")
    axes = figure.subplots()
    mesh = axes.pcolormesh(1e3 * lags, ramps, 100 * passes, cmap="RdYlGn", vmin=0, vmax=100)
    figure.colorbar(mesh, label="free moves that pass (%)")
    speed = float(np.median([speed for _, speed in moves]))
    edge = FIRST_WINDOW - speed / (2 * ramps)
    axes.plot(1e3 * edge[edge >= 0], ramps[edge >= 0], color=_INK, lw=1.2)
    axes.set(xlabel="lag (ms)", ylabel="ramp (rad/s²)", yscale="log", xlim=(0, 40))
    axes.set_title(
        f"The printed rule on {len(moves)} free moves; line: lag + v / 2a = "
        f"{1e3 * FIRST_WINDOW:.2f} ms\nat the median speed of {speed:.1f} rad/s",
        fontsize=8,
    )
    _save(figure, path)
    return float(pass_map(moves, np.array([0.02]), np.array([40.0]))[0, 0])
