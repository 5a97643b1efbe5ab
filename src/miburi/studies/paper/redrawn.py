"""Redraw the paper's figures from the running code."""

from collections import Counter
from collections.abc import Callable, Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import FancyBboxPatch
from matplotlib.text import Text

from miburi import ik
from miburi.bodies import Body
from miburi.feelings import FEELINGS
from miburi.gestures import key_poses, load, membership
from miburi.partner import Event, Partner
from miburi.robot import Robot, forward
from miburi.studies.day import COLOURS
from miburi.studies.experiment import Setup
from miburi.studies.figures import CORAL, GREY, INK
from miburi.studies.gestures.measures import Measures
from miburi.studies.paper.denavit import TABLES, frames
from miburi.studies.paper.rule import FIRST_WINDOW, pass_map

_AXES = ("#c3202f", "#3d8b37", "#2f6f9f")
XY = tuple[float, float]


def _save(figure: Figure, path: Path) -> None:
    figure.savefig(path, dpi=130, metadata={"Software": None})


_BOX = {"boxstyle": "round,pad=0.5", "facecolor": "#f6efe6", "edgecolor": INK}
_ARROW = {"arrowstyle": "-|>", "shrinkA": 0, "shrinkB": 0}


def _edge(box: Text) -> FancyBboxPatch:
    patch = box.get_bbox_patch()
    if patch is None:
        raise ValueError("this text has no box.")
    return patch


def _join(axes: Axes, before: Text, after: Text, colour: str, **bent: object) -> None:
    arrow = _ARROW | {"color": colour, **bent}
    arrow |= {"patchA": _edge(before), "patchB": _edge(after)}
    axes.annotate("", after.get_position(), before.get_position(), arrowprops=arrow)


def _loop(axes: Axes, box: Text, start: XY, end: XY, rad: float, colour: str) -> None:
    """Draw an arrow between two places on a box's edge, in fractions of the box (0 to 1)."""
    arrow = _ARROW | {"color": colour, "connectionstyle": f"arc3,rad={rad}"}
    patch = _edge(box)
    axes.annotate("", end, start, xycoords=patch, textcoords=patch, arrowprops=arrow)


def safety_figure(path: Path) -> None:
    """Draw the flow chart of the contact stop (Fig. 1)."""
    steps = (
        "the host sends final positions and speeds",
        "the card orders each motor to its place",
        "at each reading (20 ms):\nevery motor's travel over 0.1 s",
        "is one slower than 0.9372 of its due speed,\nor farther behind than a free one?",
        "stop all motors, give way,\nhold softly",
    )
    figure = Figure(figsize=(4.6, 5.2), layout="constrained")
    axes = figure.subplots()
    axes.axis("off")
    axes.set(xlim=(0, 10), ylim=(-0.7, 10))
    heights = [9.4 - 2.3 * k for k in range(len(steps))]
    boxes = [
        axes.text(5, height, words, ha="center", va="center", fontsize=9, bbox=_BOX)
        for height, words in zip(heights, steps, strict=True)
    ]
    figure.draw_without_rendering()
    for before, after in pairwise(boxes):
        _join(axes, before, after, INK)
    middle = (heights[3] + heights[4]) / 2
    axes.text(5.2, middle, "yes", fontsize=9, color=CORAL, va="center")
    reading, question = _edge(boxes[2]), _edge(boxes[3])
    back = _ARROW | {"color": INK, "connectionstyle": "arc3,rad=0.5"}
    axes.annotate("", (1, 0.5), (1, 0.5), xycoords=reading, textcoords=question, arrowprops=back)
    middle = (heights[2] + heights[3]) / 2
    axes.text(8.4, middle, "no, until\nall arrive", fontsize=8, ha="left", va="center")
    _save(figure, path)


#: The offset of a joint's name from its axis, in points.
_BESIDE = {
    "waist": (6, 8), "right_shoulder": (-8, 16), "right_elbow": (-30, 2),
    "right_fingertip": (-14, 4), "left_shoulder": (8, 16), "left_elbow": (30, 2),
    "left_fingertip": (14, 4), "head": (10, 0),
}  # fmt: skip


def dh_figure(robot: Robot, path: Path) -> None:
    """Draw the frames of the three chains at neutral (Figs. 2 and 3): x red, y green, z blue."""
    figure = Figure(figsize=(7.2, 5.2), layout="constrained")
    views = (("from the front", 1), ("from the robot's right", 0))
    panels = figure.subplots(1, 2, sharey=True, width_ratios=[1.7, 1])
    for axes, (title, across) in zip(panels, views, strict=True):
        for extremity, rows in TABLES.items():
            chain = frames(robot, extremity, robot.neutral)
            axes.plot(chain[:, across, 3], chain[:, 2, 3], color=GREY, lw=3)
            for frame in chain:
                for column, colour in enumerate(_AXES):
                    start, along = frame[[across, 2], 3], 0.022 * frame[[across, 2], column]
                    axes.annotate(
                        "", start + along, start, arrowprops={"arrowstyle": "->", "color": colour}
                    )
            # The joint of a row turns about the z axis of the frame before it.
            for row, frame in zip(rows, chain[:-1], strict=True):
                if across == 1 and (row.joint != "waist" or extremity == "head"):
                    offset = _BESIDE[row.joint]
                    axes.annotate(
                        row.joint.replace("_", " "), (frame[across, 3], frame[2, 3]), offset,
                        textcoords="offset points", fontsize=8, va="center",
                        ha="left" if offset[0] > 0 else "right",
                    )  # fmt: skip
            if across == 1:
                end = "head centre" if extremity == "head" else f"{extremity} hand"
                place = (chain[-1][across, 3], chain[-1][2, 3])
                axes.annotate(end, place, (0, 30 if extremity == "head" else -32), ha="center",
                              textcoords="offset points", fontsize=8, color=GREY)  # fmt: skip
        axes.set(aspect="equal", xlabel=f"{'xy'[across]} (m)")
        if across == 1:
            axes.set(xlim=(-0.16, 0.16), ylabel="z (m)")
        else:
            axes.set(xlim=(-0.06, 0.1))
        axes.set_title(title, fontsize=8)
        axes.set_ylim(-0.07, 0.25)
    names = [
        Line2D([], [], color=colour, label=name) for name, colour in zip("xyz", _AXES, strict=True)
    ]
    panels[1].legend(handles=names, fontsize=8, frameon=False, title="a frame's axes",
                     title_fontsize=8, loc="lower right")  # fmt: skip
    _save(figure, path)


def effort_figure(measured: Mapping[str, Measures], path: Path) -> None:
    """Draw the effort (Laban) measured in each gesture at full intensity (Fig. 5)."""
    panels: tuple[tuple[str, str, Callable[[Measures], float]], ...] = (
        ("space", "hull of hands and head (litres)", lambda one: 1e3 * one.volume),
        ("weight", "mean acceleration (m/s²)", lambda one: one.mean_acceleration),
        ("time", "mean speed of the hands (m/s)", lambda one: one.mean_speed),
        ("flow", "mean jerk (m/s³): less is freer", lambda one: one.mean_jerk),
    )
    figure = Figure(figsize=(7.6, 2.7), layout="constrained")
    for axes, (name, what, value) in zip(figure.subplots(1, 4, sharey=True), panels, strict=True):
        axes.barh(FEELINGS, [value(measured[feeling]) for feeling in FEELINGS], color=COLOURS)
        axes.set_title(name, fontsize=9)
        axes.set_xlabel(what, fontsize=7)
        axes.tick_params(labelsize=7)
        axes.spines[["top", "right"]].set_visible(False)
    axes.yaxis.set_inverted(True)
    _save(figure, path)


def flow_figure(body: Body, path: Path) -> None:
    """Run a robot partner, and draw which event followed which (Fig. 6).

    The body is touched once: a hand blocks the second gesture.
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
    # The places are chosen so that no arrow crosses another.
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
    axes.set(xlim=(-0.1, 1.1), ylim=(-0.1, 1.2))
    boxes = {
        name: axes.text(x, y, words, ha="center", va="center", fontsize=9, bbox=_BOX)
        for name, (x, y, words) in places.items()
    }
    figure.draw_without_rendering()
    for (before, after), count in sorted(follows.items()):
        (x0, y0, _), (x1, y1, _) = places[before], places[after]
        if before == after:
            _loop(axes, boxes[before], (0.75, 1), (0.25, 1), 1.2, CORAL)
            axes.text(x0, y0 + 0.125, f"{count} ×", fontsize=9, color=CORAL, ha="center")
            continue
        _join(axes, boxes[before], boxes[after], CORAL)
        plain = {"facecolor": "white", "lw": 0, "pad": 2}
        axes.text((x0 + x1) / 2, (y0 + y1) / 2, f"{count} ×", fontsize=9, color=CORAL,
                  ha="center", va="center", bbox=plain)  # fmt: skip
    _save(figure, path)


def function_figure(robot: Robot, path: Path) -> None:
    """Draw the fuzzy memberships and the eight movement functions at three moods (Fig. 7)."""
    figure = Figure(figsize=(9, 4.6), layout="constrained")
    grid = figure.subplots(2, 5)
    panel: Axes = grid[0, 0]
    moods = np.linspace(0, 1, 50)
    for hedge, style in (("more or less", ":"), ("plainly", "-"), ("very", "--")):
        function = load("happiness").model_copy(update={"hedge": hedge})
        shape = [membership(function, float(mood)) for mood in moods]
        panel.plot(moods, shape, style, color=INK, label=hedge)
    panel.set_title("membership of μ", fontsize=8)
    panel.set_xlabel("mood μ", fontsize=7)
    panel.tick_params(labelsize=7)
    panel.legend(fontsize=6, frameon=False)
    grid[1, 0].axis("off")
    grid[1, 0].text(0, 0.5, "Hands and head (black)\nfrom the front at\nμ = 0.3, 0.6, 0.9\n"
                    "(darker: more)\n\nDots: key poses\nGrey: the body at neutral\n"
                    "The bar is 100 mm", fontsize=8, va="center")  # fmt: skip
    body = [1e3 * frames(robot, extremity, robot.neutral)[:, 1:3, 3] for extremity in TABLES]
    for index, (feeling, colour) in enumerate(zip(FEELINGS, COLOURS, strict=True)):
        axes = grid[index // 4, 1 + index % 4]
        for chain in body:
            axes.plot(chain[:, 0], chain[:, 1], color=GREY, lw=0.8, alpha=0.6)
        axes.plot([90, 190], [-25, -25], color=INK, lw=1.5)
        for mood, alpha in ((0.3, 0.35), (0.6, 0.6), (0.9, 1.0)):
            angles = [robot.neutral]
            for pose in key_poses(robot, load(feeling), mood):
                angles.append(ik.solve(robot, pose.target, start=angles[-1]).angles)
            steps = [a + part * (b - a) for a, b in pairwise(angles)
                     for part in np.linspace(0, 1, 15)]  # fmt: skip
            track, dots = (1e3 * forward(robot, np.array(q)) for q in (steps, angles))
            for part, ink in ((0, colour), (3, colour), (6, INK)):
                axes.plot(track[:, part + 1], track[:, part + 2], lw=1, color=ink, alpha=alpha)
                axes.plot(dots[:, part + 1], dots[:, part + 2], "o", ms=2, color=ink,
                          alpha=alpha)  # fmt: skip
        axes.set(xlim=(-210, 210), ylim=(-40, 270), aspect="equal", xticks=[], yticks=[])
        axes.set_title(feeling, fontsize=8)
    _save(figure, path)


def rule_figure(moves: list[tuple[float, float]], path: Path) -> None:
    """Draw the share of free moves that the paper's rule lets pass, against lag and acceleration.

    ``moves`` has, for each move's fastest motor, its distance in rad and its speed in rad/s.
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
    axes.plot(1e3 * edge[edge >= 0], ramps[edge >= 0], color=INK, lw=1.2)
    axes.plot(20, 40, "o", color=INK, ms=5, fillstyle="none")
    axes.annotate("20 ms, 40 rad/s²", (20, 40), (6, 6), textcoords="offset points", fontsize=7)
    axes.set(xlabel="lag (ms)", ylabel="ramp (rad/s²)", yscale="log", xlim=(0, 40))
    title = f"The printed rule on {len(moves)} free moves; line: lag + v / 2a = "
    title += f"{1e3 * FIRST_WINDOW:.2f} ms\nat the median speed of {speed:.1f} rad/s"
    axes.set_title(title, fontsize=8)
    _save(figure, path)
