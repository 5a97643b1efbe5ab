"""Turn summaries of trials into words and tables."""

from miburi.studies.trials.summary import ISO_LIMITS, Summary

_ROWS: tuple[tuple[str, str], ...] = (
    ("free", "free trials"),
    ("blocked", "blocked trials"),
    ("false_stops", "false stops"),
    ("missed", "missed contacts"),
    ("missed_above_2N", "missed, 2 N or more over 0.1 s"),
    ("missed_peak_above_2N", "missed, peak of 2 N or more"),
    ("brushes", "brushed past, drawn again"),
    ("latency_mean", "latency, mean (s)"),
    ("latency_p95", "latency, 95th percentile (s)"),
    ("latency_max", "latency, longest (s)"),
    ("late", "stops later than 0.25 s"),
    ("latency_above_2N_max", "latency where 2 N or more over 0.1 s, longest (s)"),
    ("latency_from_1N_p95", "latency from 1 N on, 95th percentile (s)"),
    ("latency_from_1N_max", "latency from 1 N on, longest (s)"),
    ("peak_force_median", "peak force, median (N)"),
    ("peak_force_p95", "peak force, 95th percentile (N)"),
    ("peak_force_p99", "peak force, 99th percentile (N)"),
    ("peak_force_max", "peak force, largest of these (N)"),
    ("sustained_force_p95", "force over 0.1 s, 95th percentile (N)"),
    ("push_after_stop_max", "push 0.3 s after a stop, largest (N)"),
    ("right_motor", "share of stops that name a motor that carries the touched part"),
    ("self_collisions", "self-collisions"),
)


def in_words(summary: Summary) -> str:
    """Return a summary as text, a line for each figure."""
    width = max(len(words) for _, words in _ROWS)
    return "\n".join(f"{words:<{width}}  {_cell(summary, name)}" for name, words in _ROWS)


def rows(columns: dict[str, Summary]) -> list[list[str]]:
    """Return a table of summaries: each row has its title, then a cell for each summary."""
    return [
        [words, *(_cell(summary, name) for summary in columns.values())] for name, words in _ROWS
    ]


def _cell(summary: Summary, name: str) -> str:
    value = getattr(summary, name)
    if value is None:
        return "–"
    if name in ("false_stops", "missed"):
        low, high = getattr(summary, f"{name}_interval")
        return f"{value} ({100 * low:.2f} to {100 * high:.2f} %)"
    if name == "peak_force_p99" and summary.peak_force_p99_interval is not None:
        low, high = summary.peak_force_p99_interval
        return f"{value:.3g} " + (
            f"(at least {low:.3g})" if high is None else f"({low:.3g} to {high:.3g})"
        )
    return f"{value:.3g}" if isinstance(value, float) else f"{value}"


def iso_sentence() -> str:
    """Return a sentence with the limits for forces, and their source."""
    limits = ", ".join(f"{part} {force} N" for part, force in ISO_LIMITS.items())
    return (
        f"These are the quasi-static limits of ISO/TS 15066, as secondary sources quote them "
        f"({limits}); we have not read the standard itself. The limit for transient contact is "
        "commonly taken as twice that; on face and head, no transient contact is allowed."
    )
