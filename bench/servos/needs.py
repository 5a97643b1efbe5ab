"""How much of the contact rule's guards free motion needs, beside what the description grants.

    python bench/servos/needs.py [--free 3000] [--seeds 1 11]

Each run has two free moves of a varied robot, as in ``miburi trials``, under a rule that stops
nothing. What the guards in ``iphonoid.toml`` leave above the need is what a contact must overcome.
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from itertools import repeat

import numpy as np

from miburi.calibration.free_motion import measure_need
from miburi.calibration.guards import FreeTrace
from miburi.robot import JOINTS, Array, iphonoid
from miburi.safety.free import FreeRule
from miburi.safety.profile import FINE
from miburi.studies.trials.replay import record

NAMES = ("slack", "behind", "ahead", "arrival")


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--free", type=int, default=3000, help="runs of each seed")
    options.add_argument("--seeds", type=int, nargs="+", default=[1, 11])
    options.add_argument("--workers", type=int, default=2)
    chosen = options.parse_args()
    with ProcessPoolExecutor(chosen.workers) as pool:
        most = np.max(list(pool.map(needs, chosen.seeds, repeat(chosen.free))), axis=0)
    guards = vars(FreeRule.of(iphonoid()).guards)
    print(f"{len(chosen.seeds) * chosen.free} runs; encoder steps, needed of granted")
    print("| | " + " | ".join(NAMES) + " |")
    print("|---" * (len(NAMES) + 1) + "|")
    for motor, joint in enumerate(JOINTS):
        cells = [
            f"{most[row, motor]:.1f} of {guards[name][motor]}" for row, name in enumerate(NAMES)
        ]
        print(f"| {joint.replace('_', ' ')} | " + " | ".join(cells) + " |")


def needs(seed: int, free: int) -> Array:
    """Return the largest needs, (4, 8) steps."""
    robot = iphonoid()
    rule = FreeRule.of(robot)
    guards = rule.guards
    traces = (
        FreeTrace(**vars(trace), rule=rule)
        for run in record(robot, seed, free)
        for trace in run.traces
    )
    need = measure_need(traces, guards.lag, guards.least, rule.period, rule.ratio)
    most: Array = np.array([vars(need)[name] for name in NAMES]) / FINE
    return most


if __name__ == "__main__":
    main()
