"""How fast trials are with the identified servo, as a share of the rate with the imagined one.

    python bench/servos/rate.py [--rounds 5] [--trials 20]

Rounds take turns; the time is the process's own, so that other work on the machine counts little.
"""

import argparse
from time import process_time

import numpy as np

from miburi.robot import iphonoid
from miburi.safety.contact import Rule
from miburi.safety.free import FreeRule
from miburi.servos import load_servo
from miburi.studies.trials.plant import TrialPlant
from miburi.studies.trials.trial import TrialKind, trial


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--rounds", type=int, default=5)
    options.add_argument("--trials", type=int, default=20)
    chosen = options.parse_args()
    imagined = iphonoid().with_servo(load_servo("imagined"))
    real = iphonoid()
    sides = [(TrialPlant(imagined), FreeRule.of(imagined)), (TrialPlant(real), FreeRule.of(real))]
    for kind in TrialKind:
        for plant, rule in sides:
            trial(plant, rule, 1, kind, 0)  # the first compiles
        shares = []
        for number in range(chosen.rounds):
            seconds = [
                spend(plant, rule, kind, number * chosen.trials, chosen.trials)
                for plant, rule in sides
            ]
            shares.append(seconds[0] / seconds[1])
        print(
            f"{kind.value}: {np.median(shares):.2f} times the rate "
            f"({min(shares):.2f} to {max(shares):.2f} in {chosen.rounds} rounds)"
        )


def spend(plant: TrialPlant, rule: Rule, kind: TrialKind, first: int, count: int) -> float:
    """Return the seconds of processor time that ``count`` trials take."""
    began = process_time()
    for index in range(first, first + count):
        trial(plant, rule, 2, kind, index)
    return process_time() - began


if __name__ == "__main__":
    main()
