"""A run of trials in a few numbers, each with what can be said of it by so many trials."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from miburi.errors import needs_extra
from miburi.studies.trials.runs import as_array
from miburi.studies.trials.trial import Kind, Outcome

__all__ = ["ISO_LIMITS", "LATE", "MATTERS", "Summary", "summarise", "wilson"]

try:
    from scipy.stats import binomtest
except ModuleNotFoundError as error:
    raise needs_extra("studies", error) from error

#: A force from which on a missed contact matters, N (ours).
MATTERS = 2.0
#: A stop later than this after the first touch is counted as late, s (ours).
LATE = 0.25
#: Quasi-static limits of ISO/TS 15066 in N, as secondary sources quote them: we have not read
#: the standard itself. Transient contact is commonly taken as twice that; none is allowed on
#: face and head.
ISO_LIMITS = {
    "face": 65,
    "forehead": 130,
    "hand and fingers": 140,
    "forearm": 160,
    "upper arm": 150,
    "chest": 140,
}


def wilson(hits: int, trials: int) -> tuple[float, float]:
    """Return Wilson's 95 % interval (1927) of a share: ``hits`` of ``trials``; 0 to 1 of none."""
    if trials == 0:
        return 0.0, 1.0
    low, high = binomtest(hits, trials).proportion_ci(method="wilson")
    return float(low), float(high)


@dataclass(frozen=True)
class Summary:
    """Figures of a run; s and N.

    ``false_stops`` are stops before any touch, in free and blocked trials. ``missed`` are people
    pressed with 1 N or more over 0.1 s whom no stop followed; ``missed_above_2N`` those of them
    pressed with 2 N over 0.1 s, ``missed_peak_above_2N`` those on whom the force reached 2 N for
    a moment. ``late`` are stops more than 0.25 s after the first touch; ``latency_above_2N_max``
    is the latest where the force over 0.1 s reached 2 N. ``brushes`` are people only brushed
    past, in whose place others were drawn. Intervals are Wilson's, 95 %. Figures of no trial at
    all are None.
    """

    free: int
    blocked: int
    false_stops: int
    false_stops_interval: tuple[float, float]
    missed: int
    missed_interval: tuple[float, float]
    missed_above_2N: int  # noqa: N815  (the unit is written so)
    missed_peak_above_2N: int  # noqa: N815  (the unit)
    brushes: int
    latency_mean: float | None
    latency_p95: float | None
    latency_max: float | None
    late: int
    latency_above_2N_max: float | None  # noqa: N815  (the unit)
    latency_from_1N_p95: float | None  # noqa: N815  (the unit)
    latency_from_1N_max: float | None  # noqa: N815  (the unit)
    peak_force_median: float | None
    peak_force_p95: float | None
    peak_force_max: float | None
    sustained_force_p95: float | None
    push_after_stop_max: float | None
    right_motor: float | None
    self_collisions: int

    def as_json(self) -> dict[str, object]:
        """Return the figures for JSON, rounded to what they mean."""
        return {
            name: round(value, 6) if isinstance(value, float) else value
            for name, value in asdict(self).items()
        }


def summarise(outcomes: Sequence[Outcome]) -> Summary:
    """Sum up trials."""
    blocked = [o for o in outcomes if o.kind == Kind.BLOCKED]
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
        peak_force_max=_percentile(peak, 100),
        sustained_force_p95=_percentile(sustained, 95),
        push_after_stop_max=_percentile(push, 100),
        right_motor=float(as_array(answered, "right_motor").mean()) if answered else None,
        self_collisions=sum(o.self_collision for o in outcomes),
    )


def _percentile(
    values: "np.ndarray[tuple[int, ...], np.dtype[np.float64]]", p: int
) -> float | None:
    return float(np.percentile(values, p)) if len(values) else None
