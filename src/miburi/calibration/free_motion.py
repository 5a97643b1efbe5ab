"""Derive guards from free moves: what the contact rule must tolerate of these servos (our choice).

It takes :class:`Trace` objects, the encoder readings of free moves with their commanded profiles,
and gives the :class:`~miburi.robot.guards.Guards` that would have let all of them pass, with a
margin. A trace holds only what a card can measure, so simulated and real servos share this code.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from miburi.errors import InputError
from miburi.ground.compiled import compiled
from miburi.robot import JOINTS
from miburi.robot.guards import GUARDS, Guards
from miburi.safety.contact import PAPER_PERIOD, PAPER_RATIO, UNLOADED, Loading, lag_doubt
from miburi.safety.profile import FINE, Profile, Steps

#: Guards are this many times what free motion needed (our choice).
MARGIN = 1.2
#: The guard ``least``, in rad: a window with less expected travel than this is too short to judge,
#: and is extended (our choice).
LEAST = 0.0125
_LONGEST_LAG = 120_000  # µs
_WORTH_MEASURING = 50  # steps


@dataclass(frozen=True)
class Trace:
    """One move as a card sees it.

    Attributes
    ----------
    profile, start, direction, loading
        As in :class:`miburi.safety.contact.Watch`.
    times
        (n,) µs since the move began, ascending; they need not be regular.
    positions
        (n, 8) steps, the encoders at these times. Readings without an answer from a motor are left
        out, since the card does not judge them either.
    """

    profile: Profile
    start: Steps
    direction: Steps
    times: Steps
    positions: Steps
    loading: Loading = UNLOADED

    @property
    def travel(self) -> Steps:
        """The travel of each motor at each reading, (n, 8) in 1/256 steps."""
        travel: Steps = (self.positions - self.start) * self.direction * FINE
        return travel

    @property
    def goal(self) -> Steps:
        """The travel at which each motor comes to rest, (8,) in 1/256 steps."""
        return self.profile.distance * FINE + self.loading.offset - self.loading.end

    @property
    def granted(self) -> Steps:
        """The share of its guards that applies to each motor in this move, (8,) in 1/256."""
        return np.full(len(JOINTS), FINE)

    def expected(self, lag: Steps) -> Steps:
        """Return the travel of the profile, delayed by ``lag`` (8,) µs, at each reading, (n, 8)."""
        return self.profile.position(self.times[:, None] - lag)


@dataclass(frozen=True)
class Need:
    """The tolerances without which free moves would cause stops, (8,) in 1/256 steps.

    Each is the largest need over all traces.

    Attributes
    ----------
    slack
        How far the travel in a window falls short of what the ratio requires.
    behind, ahead
        The distance from the delayed profile, less the ``lag_doubt`` that the rule adds by itself.
    arrival
        Distance from the goal one period after the profile ended.
    """

    slack: Steps
    behind: Steps
    ahead: Steps
    arrival: Steps


def measure_need(
    traces: Iterable[Trace], lag: Steps, least: Steps, period: int, ratio: int
) -> Need:
    """Apply the rule of :class:`miburi.safety.contact.Watch` to free motion with guards of zero.

    If only half of a guard applies to a motor, that guard must be twice the observed shortfall.
    """
    zero = np.zeros(len(JOINTS), dtype=np.int64)
    slack, behind, ahead, arrival = zero, zero, zero, zero
    for trace in traces:
        expected, travel = trace.expected(lag), trace.travel
        doubt, granted = lag_doubt(trace.profile), trace.granted
        late_by = (expected - travel).max(axis=0) - doubt
        early_by = (travel - expected).max(axis=0) - doubt
        behind = np.maximum(behind, -(-late_by * FINE // granted))
        ahead = np.maximum(ahead, -(-early_by * FINE // granted))
        late = trace.times[:, None] >= trace.profile.total + lag + period
        away = np.abs(trace.goal - travel)
        arrival = np.maximum(arrival, np.where(late, away, 0).max(axis=0))
        missing = _missing(trace.times, expected, travel, granted, least * FINE, period, ratio)
        slack = np.maximum(slack, missing)
    return Need(slack, behind, ahead, arrival)


@compiled
def _missing(
    times: Steps,
    expected: Steps,
    travel: Steps,
    granted: Steps,
    least: Steps,
    period: int,
    ratio: int,
) -> Steps:
    """Return the largest travel that was missing from a window of one move, (8,) in 1/256 steps."""
    most = np.zeros_like(least)
    judged_expected, judged_travel = np.zeros_like(least), np.zeros_like(least)
    period_ends = period
    for k in range(len(times)):
        for j in range(len(least)):
            should, did = expected[k, j] - judged_expected[j], travel[k, j] - judged_travel[j]
            if should < least[j]:
                continue
            # Rounded up, so that a slack of this size lets the window pass.
            missing = -((did * 10_000 - should * ratio) * FINE // (10_000 * granted[j]))
            most[j] = max(most[j], missing)
            if times[k] >= period_ends:
                judged_expected[j], judged_travel[j] = expected[k, j], travel[k, j]
        if times[k] >= period_ends:
            period_ends += period
    return most


def measure_lag(traces: Sequence[Trace]) -> Steps:
    """Return how far each motor lags behind its profile, in µs, to the millisecond; shape (8,).

    The lag is the delay that minimises the sum of squares between profile and motion. A motor that
    never moved gets the median of the other motors' lags.
    """
    candidates = np.arange(0, _LONGEST_LAG + 1, 1000)
    errors = np.zeros((len(candidates), len(JOINTS)))
    moved = np.zeros(len(JOINTS), dtype=np.bool_)
    for trace in traces:
        travel = trace.travel
        moved |= trace.profile.distance >= _WORTH_MEASURING
        for row, candidate in enumerate(candidates):
            difference = trace.expected(np.full(len(JOINTS), candidate)) - travel
            errors[row] += (difference.astype(np.float64) ** 2).sum(axis=0)
    best = candidates[errors.argmin(axis=0)]
    others = int(np.median(best[moved])) if moved.any() else 0
    return np.where(moved, best, others).astype(np.int64)


def calibrate(
    traces: Sequence[Trace],
    step: float,
    *,
    lag: Steps | None = None,
    least: int | None = None,
    margin: float = MARGIN,
    period: int = PAPER_PERIOD,
    ratio: int = PAPER_RATIO,
) -> Guards[Steps]:
    """Return the guards that let free motion pass, with a margin.

    ``traces`` are many free moves, some of them fast, in which nobody touched the robot; ``step``
    is the angle of an encoder step, in rad. ``lag`` is each motor's lag, (8,) in µs, by default the
    result of :func:`measure_lag`; ``least`` is the guard of this name in steps, by default
    ``LEAST``. Each guard is ``margin`` (1 or more) times what the moves needed.

    Raises
    ------
    InputError
        There is no trace.
    """
    if not traces:
        raise InputError("A calibration needs the traces of some free moves; there are none.")
    lag = measure_lag(traces) if lag is None else lag
    judged = np.full(len(JOINTS), max(round(LEAST / step), 4) if least is None else least)

    # Guards are rounded up: with coarse encoders, one step matters.
    def widen(needed: Steps, floor: float) -> Steps:
        steps = np.ceil(needed * margin / FINE).astype(np.int64)
        return np.maximum(steps, round(floor / step))

    needs = vars(measure_need(traces, lag, judged, period, ratio))
    measured = {name: widen(needed, GUARDS[name].floor) for name, needed in needs.items()}
    return Guards(lag=lag, least=judged, **measured)
