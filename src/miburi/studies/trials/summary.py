"""Sum up the outcomes of a run, with confidence intervals for the counts."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import ceil

import numpy as np

from miburi.errors import need
from miburi.robot import Array
from miburi.studies.trials.runs import as_array
from miburi.studies.trials.trial import Outcome, TrialKind

need("scipy", "studies")  # loading it takes a second, so only the functions that use it load it

#: A missed contact matters at this force, in N, or above (our choice).
MATTERS = 2.0
#: A stop counts as late if it comes more than this, in s, after the first touch (our choice).
LATE = 0.25
#: Quasi-static limits of ISO/TS 15066 in N, as secondary sources quote them: we have not read the
#: standard itself. The limits for transient contact are commonly taken as twice these; on face and
#: head no transient contact is allowed.
ISO_LIMITS = {
    "face": 65,
    "forehead": 130,
    "hand and fingers": 140,
    "forearm": 160,
    "upper arm": 150,
    "chest": 140,
}


def wilson(hits: int, trials: int) -> tuple[float, float]:
    """Return Wilson's 95 % interval (1927) of the share ``hits / trials``; 0 to 1 for no trials."""
    if trials == 0:
        return 0.0, 1.0
    from scipy.stats import binomtest

    low, high = binomtest(hits, trials).proportion_ci(method="wilson")
    return float(low), float(high)


def needed_to_show(bound: float) -> int | None:
    """Return how many trials without a hit bring the upper end of :func:`wilson` to a bound.

    The bound is a share from 0 to 1; None for 0, which no number of trials can show.
    """
    return ceil(1.96**2 * (1 - bound) / bound) if bound else None


def what_is_shown(bound: float, stops: int, runs: int) -> str:
    """Say whether so many false stops in free ``runs`` show a bound on their share."""
    if wilson(stops, runs)[1] <= bound:
        return f"The fresh runs show the bound of {bound:.2%}."
    verb, enough = "break" if stops > bound * runs else "do not show", needed_to_show(bound)
    return (
        f"The fresh runs {verb} the bound of {bound:.2%}: "
        f"{f'at least {enough}' if enough else 'no number of'} runs without a false stop would "
        "show it."
    )


def quantile_interval(values: Array, share: float) -> tuple[float, float | None] | None:
    """Return a 95 % interval of a quantile, for any distribution.

    Its ends are two of the sorted values (David and Nagaraja, Order Statistics, 7.1). The upper end
    is None if the quantile may be above the largest value, as with few values.
    """
    count = len(values)
    if count == 0:
        return None
    from scipy.stats import binom

    ordered = np.sort(values)
    low, high = binom.ppf((0.025, 0.975), count, share).astype(int)
    return float(ordered[max(low - 1, 0)]), float(ordered[high]) if high < count else None


@dataclass(frozen=True)
class Summary:
    """Figures of a run, in s and N.

    All intervals are 95 % intervals, Wilson's for counts. A figure without any trial is None.

    ``missed`` counts the people whom the robot pressed with 1 N or more (as a mean over 0.1 s)
    without a stop. The figures above 2 N use the same mean, except ``missed_peak_above_2N``: there,
    the force reached 2 N for a moment. The interval of the 99th percentile assumes no distribution.
    The largest value has no interval, because it grows with the number of trials.
    """

    free: int
    blocked: int
    false_stops: int  #: before any touch, in free and blocked trials
    false_stops_interval: tuple[float, float]
    missed: int
    missed_interval: tuple[float, float]
    missed_above_2N: int  # noqa: N815  (that is how the unit is written)
    missed_peak_above_2N: int  # noqa: N815  (the unit)
    brushes: int  #: people whom the robot only brushed past; others were drawn in their place
    latency_mean: float | None
    latency_p95: float | None
    latency_max: float | None
    late: int  #: more than 0.25 s after the first touch
    latency_above_2N_max: float | None  # noqa: N815  (the unit)
    latency_from_1N_p95: float | None  # noqa: N815  (the unit)
    latency_from_1N_max: float | None  # noqa: N815  (the unit)
    peak_force_median: float | None
    peak_force_p95: float | None
    peak_force_p99: float | None
    peak_force_p99_interval: tuple[float, float | None] | None
    peak_force_max: float | None
    sustained_force_p95: float | None
    push_after_stop_max: float | None
    right_motor: float | None
    self_collisions: int

    def as_json(self) -> dict[str, object]:
        """Return the figures for JSON, rounded to six decimals."""
        return {
            name: round(value, 6) if isinstance(value, float) else value
            for name, value in asdict(self).items()
        }


def summarise(outcomes: Sequence[Outcome]) -> Summary:
    """Return the summary of a run's outcomes."""
    blocked = [o for o in outcomes if o.kind == TrialKind.BLOCKED]
    touched = [o for o in blocked if o.touched and not o.false_stop]
    answered = [o for o in touched if o.stopped]
    missed = [o for o in touched if not o.stopped]
    false_stops = sum(o.false_stop for o in outcomes)
    latency, push = as_array(answered, "latency"), as_array(answered, "push_after_stop")
    pressed = [o for o in answered if o.sustained_force >= MATTERS]
    firm = as_array(answered, "latency_from_1N")
    firm = firm[np.isfinite(firm)]
    peak, sustained = as_array(touched, "peak_force"), as_array(touched, "sustained_force")
    return Summary(
        free=len(outcomes) - len(blocked),
        blocked=len(blocked),
        false_stops=false_stops,
        false_stops_interval=wilson(false_stops, len(outcomes)),
        missed=len(missed),
        missed_interval=wilson(len(missed), len(touched)),
        missed_above_2N=sum(o.sustained_force >= MATTERS for o in missed),
        missed_peak_above_2N=sum(o.peak_force >= MATTERS for o in missed),
        brushes=sum(o.brushes for o in blocked),
        latency_mean=float(latency.mean()) if answered else None,
        latency_p95=_percentile(latency, 95),
        latency_max=_percentile(latency, 100),
        late=int((latency > LATE).sum()),
        latency_above_2N_max=_percentile(as_array(pressed, "latency"), 100),
        latency_from_1N_p95=_percentile(firm, 95),
        latency_from_1N_max=_percentile(firm, 100),
        peak_force_median=_percentile(peak, 50),
        peak_force_p95=_percentile(peak, 95),
        peak_force_p99=_percentile(peak, 99),
        peak_force_p99_interval=quantile_interval(peak, 0.99),
        peak_force_max=_percentile(peak, 100),
        sustained_force_p95=_percentile(sustained, 95),
        push_after_stop_max=_percentile(push, 100),
        right_motor=float(as_array(answered, "right_motor").mean()) if answered else None,
        self_collisions=sum(o.self_collision for o in outcomes),
    )


def _percentile(values: Array, p: int) -> float | None:
    return float(np.percentile(values, p)) if len(values) else None
