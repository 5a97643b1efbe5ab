"""The best contact rule for one kind of servo, under a bound on false stops.

Recorded runs are judged again by each candidate (p, ratio, guards); the Bacterial Memetic
Algorithm searches among them, as it does for the inverse kinematics.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from miburi import bma
from miburi.calibration.free_motion import calibrate, measured_lag
from miburi.errors import InputError
from miburi.robot import Array
from miburi.safety.contact import Rule
from miburi.safety.profile import SECOND
from miburi.studies.trials.replay import judge
from miburi.studies.trials.trial import PATIENCE, Run

__all__ = ["BOX", "Tuned", "Verdict", "assess", "tune"]

#: What is searched, and from where to where: p in readings of 10 ms, the ratio, the travel in
#: rad below which a motor is judged later, and the margin of the guards (ours). A card takes no
#: ratio below 0.8.
BOX = ((5.0, 20.0), (0.8, 0.99), (0.004, 0.05), (1.0, 2.5))
#: Points that are tried at most, and seconds that a false stop above the bound costs.
_BUDGET, _PENALTY = 150, 100.0
_READING = SECOND // 100


@dataclass(frozen=True)
class Verdict:
    """What a rule does to recorded runs.

    Attributes
    ----------
    false_stops
        Share of the runs that it stops before anybody is touched.
    missed
        Share of touched people whom it does not notice.
    delay
        s for which a touched person is pushed in the mean; ``PATIENCE`` for one who is missed.
    force
        N, the median of the peak forces until the stop.
    """

    false_stops: float
    missed: float
    delay: float
    force: float


@dataclass(frozen=True)
class Tuned:
    """The best rule found, what it does, and how many were tried."""

    rule: Rule
    verdict: Verdict
    tried: int


def assess(rule: Rule, runs: Sequence[Run]) -> Verdict:
    """Judge recorded runs, free and blocked, by ``rule``."""
    false, delays, forces = 0, [], []
    for run in runs:
        found = judge(rule, run)
        if found.stopped_at is not None and found.latency is None:
            false += 1
        elif run.touched_at is not None:
            delays.append(PATIENCE if found.latency is None else min(found.latency, PATIENCE))
            forces.append(found.peak_force)
    return Verdict(
        false / len(runs) if runs else 0.0,
        float(np.mean(np.array(delays) >= PATIENCE)) if delays else 0.0,
        float(np.mean(delays)) if delays else 0.0,
        float(np.median(forces)) if forces else 0.0,
    )


def tune(
    runs: Sequence[Run],
    step: float,
    bound: float,
    seed: int,
    progress: Callable[[int], None] = lambda _tried: None,
) -> Tuned:
    """Find the rule that lets a touched person wait least, with few enough false stops.

    Every other free run calibrates the guards of a candidate; all other runs judge it.

    Parameters
    ----------
    runs
        Recorded by a deaf rule: free and blocked.
    step
        Angle of one encoder step, rad.
    bound
        The share of false stops that is allowed, 0 to 1.
    seed
        Of the search.
    progress
        Called with the number of rules tried.

    Raises
    ------
    InputError
        The bound is not from 0 to 1, or free or blocked runs are missing.
    """
    if not 0 <= bound <= 1:
        raise InputError(f"the bound on false stops must be from 0 to 1, got {bound!r}.")
    free = [run for run in runs if run.person is None]
    blocked = [run for run in runs if run.person is not None]
    if len(free) < 2 or not blocked:
        raise InputError("tuning needs recorded runs: two free ones and a blocked one at least.")
    traces = [trace for run in free[::2] for trace in run.traces]
    judges, lag = free[1::2] + blocked, measured_lag(traces)
    known: dict[tuple[int, int, int, int], Tuned] = {}

    def candidate(point: Array) -> Tuned:
        readings, ratio, least, margin = point
        key = (round(readings), round(1000 * ratio), round(least / step), round(20 * margin))
        if key not in known:
            period, limit = key[0] * _READING, 10 * key[1]
            guards = calibrate(
                traces, step,
                lag=lag, least=key[2], margin=key[3] / 20, period=period, ratio=limit,
            )  # fmt: skip
            rule = Rule(guards, period, limit)
            known[key] = Tuned(rule, assess(rule, judges), 0)
            progress(len(known))
        return known[key]

    def cost(point: Array) -> float:
        verdict = candidate(point).verdict
        return verdict.delay + _PENALTY * max(0.0, verdict.false_stops - bound)

    search = bma.Optimizer(BOX, seed=seed, settings=_SETTINGS)
    while not search.finished and len(known) < _BUDGET:
        points = search.ask()
        search.tell([cost(np.asarray(point)) for point in points])
    best = min(
        known.values(),
        key=lambda t: t.verdict.delay + _PENALTY * max(0.0, t.verdict.false_stops - bound),
    )
    return Tuned(best.rule, best.verdict, len(known))


# A judged rule costs half a second: small generations, and no gradients of what has steps.
_SETTINGS = bma.Settings(
    generations=12, individuals=6, clones=3, transfers=4, local_probability=0.0,
    first_iterations=0, target=-np.inf, local_first=False,
)  # fmt: skip
