"""Compare the ratios of all runs of ``make bench-ik`` with those of the last, which is the page's.

``python bench/ik/spread.py`` prints a line for each ratio, and fails if one run's is more than 15 %
off. The runs are in ``out/bench-ik``; remove those that do not belong together.
"""

import json
import sys
from itertools import chain
from pathlib import Path
from statistics import median

RUNS = Path(__file__).parents[2] / "out" / "bench-ik"
ALLOWED = 0.15


def ratios(run):
    """Return (solver, which) → median ratio over all rounds and processes of a run."""
    files = sorted(run.glob("process-*.json"))
    results = [json.loads(path.read_text())["results"] for path in files]
    return {
        (name, field): median(chain.from_iterable(result[name][field] for result in results))
        for name in results[0]
        for field in ("times_near", "times_far")
        if results[0][name][field]
    }


def main():
    found = [ratios(run) for run in sorted(RUNS.iterdir(), key=lambda run: int(run.name))]
    off = 0
    for name, field in found[-1]:
        each = [run[name, field] for run in found]
        most = max(abs(value / each[-1] - 1) for value in each)
        off += most > ALLOWED
        where = "in reach" if field == "times_near" else "beyond"
        line = ", ".join(f"{value:.3g}" for value in each)
        print(f"{name:40} {where:9} {line:40} {most:6.1%}{' !' if most > ALLOWED else ''}")
    print(f"{len(found)} runs: {off} of {len(found[-1])} ratios are more than {ALLOWED:.0%} off.")
    sys.exit(off > 0)


if __name__ == "__main__":
    main()
