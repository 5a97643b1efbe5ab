"""Search for the best contact rule for one kind of servo, under a bound on false stops.

Each candidate (p, ratio, guards) judges recorded runs, and the Bacterial Memetic Algorithm searches
among the candidates, as it does for the inverse kinematics.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from miburi import bma
from miburi.calibration.free_motion import calibrate
from miburi.calibration.guards import FreeTrace
from miburi.errors import InputError
from miburi.robot import Array, Robot
from miburi.safety.contact import Rule
from miburi.safety.free import FreeRule
from miburi.safety.profile import SECOND
from miburi.studies.trials.replay import judge
from miburi.studies.trials.trial import PATIENCE, Run

#: Bounds of the search: p in readings of 10 ms, the ratio, how far in rad a motor travels before it
#: is judged, and the margin of the guards (our choice). An Arduino card accepts no ratio below 0.8.
BOX = ((5.0, 20.0), (0.8, 0.99), (0.004, 0.05), (1.0, 2.5))
#: How many points are tried at most; and the cost, in s, of each unit by which the share of false
#: stops exceeds the bound.
_BUDGET, _PENALTY = 150, 100.0
_READING = SECOND // 100


@dataclass(frozen=True)
class Verdict:
    """The effect of a rule on recorded runs."""

    false_stops: float  #: share of the runs that it stops before any touch
    missed: float  #: share of touched people whom it does not notice
    delay: float  #: s, mean from touch to stop; a missed contact counts as ``PATIENCE``
    force: float  #: N, median of the largest forces before the stop
    runs: int = 0  #: ``false_stops`` is a share of these
    touched: int = 0  #: ``missed`` is a share of these


@dataclass(frozen=True)
class Tuned:
    """The best rule, its effect on the runs it was chosen by, and the number of rules tried."""

    rule: FreeRule
    verdict: Verdict
    tried: int


def free_traces(rule: FreeRule, runs: Sequence[Run]) -> list[FreeTrace]:
    """Return the traces of runs, for a rule's model of an unhindered servo."""
    return [FreeTrace(**vars(trace), rule=rule) for run in runs for trace in run.traces]


def assess(rule: Rule, runs: Sequence[Run]) -> Verdict:
    """Judge recorded runs, free and blocked, by ``rule``."""
    false, delays, forces = 0, [], []
    for run in runs:
        judgement = judge(rule, run)
        latency = judgement.latency
        if judgement.stopped_at is not None and latency is None:
            false += 1
        elif run.touched_at is not None:
            delays.append(PATIENCE if latency is None else min(latency, PATIENCE))
            forces.append(judgement.peak_force)
    return Verdict(
        false / len(runs) if runs else 0.0,
        float(np.mean(np.array(delays) >= PATIENCE)) if delays else 0.0,
        float(np.mean(delays)) if delays else 0.0,
        float(np.median(forces)) if forces else 0.0,
        len(runs),
        len(delays),
    )


def tune(
    robot: Robot,
    runs: Sequence[Run],
    bound: float,
    seed: int,
    progress: Callable[[int], None] = lambda _tried: None,
) -> Tuned:
    """Return the rule with the smallest delay whose share of false stops is within the bound.

    The runs are under a deaf rule; see :func:`miburi.studies.trials.replay.record`. Every other
    free run calibrates a candidate's guards; the candidate then judges the other free runs and all
    blocked ones. ``progress`` is called with the number of rules tried.

    Raises InputError if the bound is not from 0 to 1, or free or blocked runs are missing.
    """
    if not 0 <= bound <= 1:
        raise InputError(f"the bound on false stops must be from 0 to 1, got {bound!r}.")
    free = [run for run in runs if run.person is None]
    blocked = [run for run in runs if run.person is not None]
    if len(free) < 2 or not blocked:
        raise InputError("tuning needs at least two free runs and one blocked run.")
    expected, step = FreeRule.of(robot), robot.servo.step
    traces = free_traces(expected, free[::2])
    judges, lag = free[1::2] + blocked, expected.guards.lag
    tried: dict[tuple[int, int, int, int], Tuned] = {}

    def candidate(point: Array) -> Tuned:
        readings, ratio, least, margin = point
        key = (round(readings), round(1000 * ratio), round(least / step), round(20 * margin))
        if key not in tried:
            period, limit = key[0] * _READING, 10 * key[1]
            guards = calibrate(
                traces, step,
                lag=lag, least=key[2], margin=key[3] / 20, period=period, ratio=limit,
            )  # fmt: skip
            rule = replace(expected, guards=guards, period=period, ratio=limit)
            tried[key] = Tuned(rule, assess(rule, judges), 0)
            progress(len(tried))
        return tried[key]

    def cost(tuned: Tuned) -> float:
        verdict = tuned.verdict
        return verdict.delay + _PENALTY * max(0.0, verdict.false_stops - bound)

    search = bma.Optimizer(BOX, seed=seed, settings=_SETTINGS)
    while not search.finished and len(tried) < _BUDGET:
        points = search.ask()
        search.tell([cost(candidate(np.asarray(point))) for point in points])
    best = min(tried.values(), key=cost)
    return Tuned(best.rule, best.verdict, len(tried))


# Judging a rule takes half a second, so generations are small. The cost has steps, so there is no
# local search.
_SETTINGS = bma.Settings(
    generations=12, individuals=6, clones=3, transfers=4, local_probability=0.0,
    first_iterations=0, target=-np.inf, local_first=False,
)  # fmt: skip
