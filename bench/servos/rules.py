"""The rule with the delayed profile, and with the free servo, on the same robots and people.

    python bench/servos/rules.py [--free 1000] [--blocked 500] [--seed 31]

The robot has the identified servo, each trial its own voltage, friction, load, noise and delay.
The free servo's guards are those that ship; the others are fixed, in encoder steps: slack / behind
and ahead / arrival, the waist's wider.
"""

import argparse

import numpy as np

from miburi.robot import iphonoid
from miburi.robot.guards import Guards
from miburi.safety.contact import Rule
from miburi.safety.free import FreeRule
from miburi.servos import load_servo
from miburi.studies.trials.runs import Plan, carry_out_plan


def guards(lag: int, slack: int, astray: int, arrival: int, waist: tuple[int, int]) -> Guards:
    def each(waists: int, others: int):
        return np.array([waists] + [others] * 7)

    return Guards(
        lag=each(lag, lag), slack=each(waist[0], slack), least=each(8, 8),
        behind=each(waist[1], astray), ahead=each(waist[1], astray),
        arrival=each(waist[1], arrival),
    )  # fmt: skip


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    for name, default in (("free", 1000), ("blocked", 500), ("seed", 31), ("workers", 2)):
        options.add_argument(f"--{name}", type=int, default=default)
    chosen = options.parse_args()
    robot = iphonoid().with_servo(load_servo("xl330-m288-t"))
    rules = {
        "free servo": FreeRule.of(robot),
        "delayed profile, 16/20/14, waist 16/20": Rule(guards(14_000, 16, 20, 14, (16, 20))),
        "delayed profile, 20/26/16, waist 20/26": Rule(guards(14_000, 20, 26, 16, (20, 26))),
    }
    for name, rule in rules.items():
        plan = Plan(((robot, rule),), chosen.seed, chosen.free, chosen.blocked)
        report(name, carry_out_plan(plan, workers=chosen.workers))


def report(name: str, outcomes) -> None:
    free = [one for one in outcomes if one.kind == "free"]
    met = [one for one in outcomes if one.kind == "blocked" and not one.false_stop]
    false = sum(one.stopped for one in free), len(outcomes) - len(free) - len(met)
    missed = [one.sustained_force for one in met if not one.stopped]
    stopped = [one for one in met if one.stopped]
    late = [one for one in met if one.sustained_force >= 2 and not one.latency <= 0.25]
    latency = 1e3 * np.array([one.latency for one in stopped])
    force = np.array([one.sustained_force for one in met])
    worst = max(missed, default=0.0)
    print(f"{name}")
    print(f"  false stops {false[0]} of {len(free)} free, {false[1]} before the touch")
    print(f"  missed {len(missed)} of {len(met)}, the hardest {worst:.1f} N over 0.1 s")
    print(f"  latency {centiles(latency)} ms; {len(late)} above 0.25 s where 2 N or more")
    print(f"  force over 0.1 s {centiles(force, 1)} N", end="; ")
    print(f"push after the stop at most {max(one.push_after_stop for one in stopped):.2f} N")


def centiles(values, digits: int = 0) -> str:
    return " / ".join(f"{each:.{digits}f}" for each in np.percentile(values, (50, 95, 100)))


if __name__ == "__main__":
    main()
