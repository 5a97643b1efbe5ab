"""Draw figures of contact trials and of recorded runs, for print."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from miburi.safety.contact import PAPER_PERIOD, PAPER_RATIO, Rule
from miburi.safety.printed import PrintedRule
from miburi.studies.figures import BLUE, CORAL, GREY, INK, PRINT, figure_file
from miburi.studies.trials.conditions import HandKind
from miburi.studies.trials.runs import as_array
from miburi.studies.trials.summary import ISO_LIMITS
from miburi.studies.trials.trial import Outcome, Run, TrialKind
from miburi.studies.trials.tuning import Verdict, assess

#: The periods, in µs, and the ratios, in parts per 10 000, of the rules on the map.
PERIODS = (50_000, 100_000, 150_000, 200_000)
RATIOS = (5000, 7000, 8500, PAPER_RATIO, 9800)


def distributions(outcomes: Sequence[Outcome], path: Path) -> None:
    """Draw the latencies of stops and the forces on people, by kind of hand."""
    met = [o for o in outcomes if o.kind == TrialKind.BLOCKED and o.touched and not o.false_stop]
    with figure_file(path, (7.6, 2.7), PRINT, dpi=150) as figure:
        late, hard, fast = figure.subplots(1, 3)
        colours = (CORAL, BLUE, INK, GREY)
        for hand, colour in zip(HandKind, colours, strict=True):
            some = [o for o in met if o.hand == hand]
            if not some:
                continue
            latency = np.sort(as_array(some, "latency"))  # missed contacts are NaN, and come last
            share = np.arange(1, len(some) + 1) / len(some)
            late.plot(1e3 * latency, share, color=colour, label=hand.value)
            hard.plot(np.sort(as_array(some, "peak_force")), share, color=colour)
            fast.plot(
                as_array(some, "speed"), as_array(some, "peak_force"), ".", markersize=2,
                color=colour, alpha=0.5,
            )  # fmt: skip
        late.set(xlabel="latency from touch (ms)", ylabel="share of trials", xlim=(0, 300))
        late.legend(frameon=False, fontsize=8, loc="lower right")
        hard.set(xlabel="peak force (N)", xlim=(0, 30))
        fast.set(xlabel="speed of the part that was touched (m/s)", ylabel="peak force (N)")
        fast.axhline(ISO_LIMITS["face"], color=CORAL, linewidth=0.9, linestyle="--")
        fast.text(
            0.03, ISO_LIMITS["face"] - 5, "face, 65 N", fontsize=8, color=CORAL,
            transform=fast.get_yaxis_transform(),
        )  # fmt: skip
        fast.set(xlim=(0, None), ylim=(0, ISO_LIMITS["face"] + 5))


@dataclass(frozen=True)
class Point:
    """A rule on the map: its period in µs, its ratio in parts per 10 000, and its effect."""

    period: int
    ratio: int
    printed: bool
    verdict: Verdict


def rule_map(runs: Sequence[Run], ours: Rule) -> list[Point]:
    """Judge recorded runs over a grid of (p, ratio), by Miburi's rule and by the paper's.

    All points use the guards for the paper's p and ratio, so that the map shows the effect of p and
    ratio alone.
    """
    points = []
    for period in PERIODS:
        for ratio in RATIOS:
            for kind in (ours, PrintedRule(ours.guards)):
                rule = replace(kind, period=period, ratio=ratio)
                points.append(Point(period, ratio, kind is not ours, assess(rule, runs)))
    return points


def rule_map_figure(points: Sequence[Point], path: Path) -> None:
    """Draw false stops against missed contacts and delay, with a ring at the paper's parameters."""
    with figure_file(path, (7.2, 3.0), PRINT, dpi=150) as figure:
        axes = figure.subplots(1, 2, sharey=True)
        colours = dict(zip(PERIODS, (CORAL, BLUE, INK, GREY), strict=True))
        for axis, name in zip(axes, ("missed", "delay"), strict=True):
            for period in PERIODS:
                for printed in (False, True):
                    some = [p for p in points if p.period == period and p.printed == printed]
                    scale = 100 if name == "missed" else 1000
                    axis.plot(
                        [scale * getattr(p.verdict, name) for p in some],
                        [100 * p.verdict.false_stops for p in some],
                        marker="s" if printed else "o", markersize=4, linewidth=0.7,
                        color=colours[period], fillstyle="none" if printed else "full",
                        label=None if printed else f"p = {period / 1e6:g} s",
                    )  # fmt: skip
                    for p in some:
                        if (p.period, p.ratio) == (PAPER_PERIOD, PAPER_RATIO):
                            axis.plot(
                                scale * getattr(p.verdict, name), 100 * p.verdict.false_stops,
                                "o", markersize=11, fillstyle="none", color=INK,
                            )  # fmt: skip
        axes[0].set(xlabel="missed contacts (%)", ylabel="false stops (%)")
        axes[1].set(xlabel="mean time from touch to stop (ms)")
        axes[0].legend(frameon=False, fontsize=8)
        figure.suptitle(
            "Dots: with guards; squares: as printed; rings: p = 0.1 s and 0.9372. "
            "Along a line the ratio grows from 0.5 to 0.98.",
            fontsize=8, x=0.01, ha="left",
        )  # fmt: skip
