"""Section 5 of the paper: its experiment."""

from functools import partial
from itertools import pairwise

import numpy as np

from miburi.studies.paper.claim import Claims, Finding, claim, holds
from miburi.studies.paper.runs import Runs
from miburi.studies.trials.summary import summarise

#: "Never missed" means, at 95 % confidence, that fewer than one contact in a thousand is missed
#: (our threshold).
_NEVER = 0.001

EXPERIMENT: Claims = {}
_claim = partial(claim, EXPERIMENT, "5")


@_claim(
    "The robot stopped “whenever and only when its movements were blocked”.",
    ours="the condition: a press of less than 2 N may be missed ([contact safety](safety.md))",
)
def _whenever_and_only_when(runs: Runs) -> Finding:
    made = runs.experiments
    stops = sum(len(run.stops) for run in made)
    false, missed = sum(run.false_stops for run in made), sum(len(run.missed) for run in made)
    trials = summarise(runs.outcomes)
    here = bool(stops) and false == missed == 0
    low, high = (100 * share for share in trials.missed_interval)
    return holds(
        here and trials.false_stops == 0 and trials.missed_interval[1] < _NEVER,
        here and trials.false_stops <= trials.free / 1000 and not trials.missed_above_2N,
    ), (
        f"{stops} stops in {len(made)} runs of 30 s: {false} false, {missed} contacts missed; "
        f"{trials.free} + {trials.blocked} trials: {trials.false_stops} false, {trials.missed} "
        f"contacts missed ({low:.2f} to {high:.2f} %)"
        + (f", {trials.missed_above_2N} of them with 2 N or more" if trials.missed else "")
    )


@_claim("“As a consequence, its movements were then slower and used less space.”")
def _slower_and_smaller(runs: Runs) -> Finding:
    smaller = pairs = 0
    for run in runs.experiments:
        whole = [gesture for gesture in run.gestures if gesture.complete]
        for before, after in pairwise(whole):
            if after.mood < before.mood - 0.01:
                pairs += 1
                smaller += after.extent < before.extent and after.mean_speed < before.mean_speed
    return holds(pairs and smaller == pairs), (
        f"{smaller} of {pairs} gestures after a stop are both smaller and slower than the "
        "complete one before it"
    )


@_claim(
    "“The robot periodically moves with a period of p = 2 s.”",
    ours="the condition is the paper's feeling, happiness",
)
def _period(runs: Runs) -> Finding:
    """Check when gestures begin, and which feelings' gestures fit into a period."""
    made = [run.gestures for run in runs.experiments]
    offs = [[abs(g.start - 2 * round(g.start / 2)) for g in gestures] for gestures in made]
    first = max((off[0] for off in offs if off), default=np.inf)
    late = max((late for off in offs for late in off[1:]), default=np.inf)
    fit = [feeling for feeling, run in runs.undisturbed.items() if not run.too_long]
    regular = max(first, late) < 0.021 and "happiness" in fit
    long = [run.gestures[0].end - run.gestures[0].start for run in runs.undisturbed.values()]
    return holds(regular and len(fit) == len(runs.undisturbed), regular), (
        f"{sum(map(len, made))} gestures of happiness start at multiples of 2 s, within "
        f"{1e3 * late:.0f} ms, the first of a run within {1e3 * first:.0f} ms (one step of the "
        f"loop); at μ = 0.9, for {len(fit)} of the {len(long)} feelings "
        f"({', '.join(fit) or 'none'}) the gesture ends within 2 s, the others take up to "
        f"{max(long):.1f} s, and the next one starts at the multiple after that"
    )


@_claim("“The robot moved to the right positions.”", ours="the condition is the default solver")
def _right_positions(runs: Runs) -> Finding:
    """Measure the error of the default solver, and of the paper's with its Table 2 as printed."""
    errors = 1e3 * np.array([solution.error for solution in runs.printed_solver.solutions])
    medians = np.median(errors, axis=0)
    default = 1e3 * max(s.error.max() for s in runs.experiments[0].solutions)
    return holds(False, default < 0.01), (
        f"the default is within {default:.1g} mm; Table 2 as printed is off by {medians[0]:.2f} mm "
        f"(right hand), {medians[1]:.2f} mm (left) and {medians[2]:.2f} mm (head), median; "
        f"{errors.max():.2f} mm at most"
    )
