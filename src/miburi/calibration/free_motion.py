"""From free motion to guards: what the contact rule must grant the servos of one robot (ours).

A calibration needs only what a card sees: encoder readings beside the commanded profile of each
move. So the same code serves the simulated servos and those of a built robot.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from miburi.errors import InputError
from miburi.robot import JOINTS, Array
from miburi.robot.guards import GUARDS, Guards
from miburi.safety.contact import PAPER_PERIOD, PAPER_RATIO, UNLOADED, Loading, lag_doubt
from miburi.safety.profile import FINE, Profile, Steps

__all__ = [
    "LEAST",
    "MARGIN",
    "Need",
    "Response",
    "Trace",
    "calibrate",
    "measured_lag",
    "need",
    "response",
]

#: Guards are so many times what free motion needed (ours).
MARGIN = 1.2
#: Windows in which a motor should have moved less than this, rad, are judged later (ours).
LEAST = 0.0125
_LONGEST_LAG = 120_000  # µs
#: Ramps that are tried, as parts of the commanded one; and lags with each, µs about the one found.
_RAMPS = np.linspace(0.6, 1.2, 13)
_OTHER_LAGS = np.arange(-26_000, 26_001, 2000)
_WORTH_MEASURING = 50  # steps


@dataclass(frozen=True)
class Trace:
    """One move as the card saw it.

    Attributes
    ----------
    profile, start, direction, loading
        As :class:`miburi.safety.contact.Watch` takes them.
    times
        (n,) µs since the move began, in order; they need not be regular.
    positions
        (n, 8) steps, the encoders at these times. A reading in which a motor was not heard is
        left out: the card does not judge it either.
    """

    profile: Profile
    start: Steps
    direction: Steps
    times: Steps
    positions: Steps
    loading: Loading = UNLOADED

    @property
    def travel(self) -> Steps:
        """Travel of each motor at each reading, (n, 8) in 1/256 steps."""
        travel: Steps = (self.positions - self.start) * self.direction * FINE
        return travel

    def expected(self, lag: Steps) -> Steps:
        """Travel that the profile, ``lag`` (8,) µs late, commanded at each reading, (n, 8)."""
        return self.profile.position(self.times[:, None] - lag)


@dataclass(frozen=True)
class Need:
    """What free motion needed of the rule: the largest over all traces, (8,) in 1/256 steps.

    ``slack``: travel that was missing beyond the ratio in a window; ``behind`` and ``ahead``:
    distance from the delayed profile, without what the doubt of the lag grants; ``arrival``:
    distance from the goal one period after the profile ended.
    """

    slack: Steps
    behind: Steps
    ahead: Steps
    arrival: Steps


def need(traces: Iterable[Trace], lag: Steps, least: Steps, period: int, ratio: int) -> Need:
    """Look at free motion as :class:`miburi.safety.contact.Watch` does, and grant nothing."""
    zero = np.zeros(len(JOINTS), dtype=np.int64)
    slack, behind, ahead, arrival = zero, zero, zero, zero
    for trace in traces:
        expected, travel = trace.expected(lag), trace.travel
        doubt = lag_doubt(trace.profile)
        behind = np.maximum(behind, (expected - travel).max(axis=0) - doubt)
        ahead = np.maximum(ahead, (travel - expected).max(axis=0) - doubt)
        late = trace.times[:, None] >= trace.profile.total + lag + period
        away = np.abs(trace.profile.distance * FINE - travel)
        arrival = np.maximum(arrival, np.where(late, away, 0).max(axis=0))
        judged_expected, judged_travel, period_ends = zero, zero, period
        for row, time in enumerate(trace.times.tolist()):
            should, did = expected[row] - judged_expected, travel[row] - judged_travel
            judged = should >= least * FINE
            # Rounded up: so much, in whole parts, would have been enough.
            missing = -((did * 10_000 - should * ratio) // 10_000)
            slack = np.where(judged, np.maximum(slack, missing), slack)
            if time >= period_ends:
                period_ends += period
                judged_expected = np.where(judged, expected[row], judged_expected)
                judged_travel = np.where(judged, travel[row], judged_travel)
    return Need(slack, behind, ahead, arrival)


def measured_lag(traces: Sequence[Trace]) -> Steps:
    """Return by how much each motor follows its profile late, (8,) µs, to the millisecond.

    It is the delay at which the profile is nearest to the motion, in the sum of squares; a motor
    that never moved is given the others' median.
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


@dataclass(frozen=True)
class Response:
    """How servos answer their commands, (8,): NaN for a ramp or noise of one that never moved.

    Attributes
    ----------
    lag
        µs.
    ramp
        Acceleration over the commanded one.
    noise
        Steps, the root mean square of what lag alone does not explain while a profile runs.
    """

    lag: Steps
    ramp: Array
    noise: Array


def response(traces: Sequence[Trace]) -> Response:
    """Measure how servos answer, from free motion: to be read by people, as a check."""
    lag = measured_lag(traces)
    # A gentle ramp at both ends looks like a longer lag: both are fitted together.
    errors = np.zeros((len(_RAMPS), len(_OTHER_LAGS), len(JOINTS)))
    squares, count = np.zeros(len(JOINTS)), np.zeros(len(JOINTS))
    for trace in traces:
        profile, travel = trace.profile, trace.travel
        far = profile.distance >= _WORTH_MEASURING
        runs = far & (trace.times[:, None] <= profile.total + lag)
        for row, ramp in enumerate(_RAMPS):
            acceleration = np.rint(profile.acceleration * ramp).astype(np.int64)
            other = Profile.plan(profile.distance, profile.speed, acceleration)
            expected = other.position(trace.times[:, None, None] - lag - _OTHER_LAGS[:, None])
            missed = (expected - travel[:, None]) / FINE
            errors[row] += (missed**2 * far).sum(axis=0)
        squares += (((trace.expected(lag) - travel) / FINE) ** 2 * runs).sum(axis=0)
        count += runs.sum(axis=0)
    moved = count > 0
    noise = np.sqrt(np.divide(squares, count, out=np.full(len(JOINTS), np.nan), where=moved))
    return Response(lag, np.where(moved, _RAMPS[errors.min(axis=1).argmin(axis=0)], np.nan), noise)


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
    """Return the guards that free motion needs, with a margin.

    Parameters
    ----------
    traces
        Free moves, many and fast enough: nobody may have touched the robot.
    step
        Angle of one encoder step, rad.
    lag
        (8,) µs; by default :func:`measured_lag` of the traces.
    least
        Steps that a motor should have moved in a window that is judged; by default ``LEAST``.
    margin
        Times what was needed, 1 or more.

    Raises
    ------
    InputError
        There is no trace.
    """
    if not traces:
        raise InputError("a calibration needs the traces of some free moves, got none.")
    lag = measured_lag(traces) if lag is None else lag
    judged = np.full(len(JOINTS), max(round(LEAST / step), 4) if least is None else least)

    # Rounded up: with coarse encoders a step more or less is much.
    def granted(needed: Steps, floor: float) -> Steps:
        steps = np.ceil(needed * margin / FINE).astype(np.int64)
        return np.maximum(steps, round(floor / step))

    needs = vars(need(traces, lag, judged, period, ratio))
    measured = {name: granted(needed, GUARDS[name].floor) for name, needed in needs.items()}
    return Guards(lag=lag, least=judged, **measured)
