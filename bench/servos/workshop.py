"""Robots as they leave a workshop, each calibrated as its maker would: what then passes, and stops.

    python bench/servos/workshop.py [--free 100] [--blocked 60] [--robots 12] [--seed 3]

A robot's servos and masses are spread as :mod:`miburi.robot.specimens` says, but for its clock;
those that drive it know its description and its encoders alone.
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from itertools import repeat

import numpy as np

from miburi.errors import BodyError
from miburi.robot import iphonoid
from miburi.robot.specimens import specimens
from miburi.studies.trials.plant import TrialPlant
from miburi.studies.trials.trial import TrialKind, trial
from miburi.studies.trials.workshop import calibrate_servos


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    numbers = (("free", 100), ("blocked", 60), ("robots", 12), ("seed", 3), ("workers", 2))
    for name, default in numbers:
        options.add_argument(f"--{name}", type=int, default=default)
    chosen = options.parse_args()
    print("| stiffness, friction | robot's time, s | gain | free stopped | missed | latency, ms |")
    print("|---|---|---|---|---|---|")
    each = (chosen.robots, chosen.seed, chosen.free, chosen.blocked)
    with ProcessPoolExecutor(chosen.workers) as pool:
        for line in pool.map(one, range(chosen.robots), *map(repeat, each)):
            print(line, flush=True)


def one(number: int, robots: int, seed: int, free: int, blocked: int) -> str:
    robot = iphonoid()
    true = specimens(robot, seed, robots)[number].robot
    own, described = true.servo.model, robot.servo.model
    head = (
        f"| × {own.stiffness / described.stiffness:.1f}, "
        f"× {own.friction.dry / described.friction.dry:.1f}"
    )
    try:
        done = calibrate_servos(robot, seed, true)
    except BodyError as error:
        return f"{head} | refused: {error} |"
    plant = TrialPlant(done.robot, done.true)
    stopped = sum(
        trial(plant, done.rule, seed, TrialKind.FREE, index).stopped for index in range(free)
    )
    people = [trial(plant, done.rule, seed, TrialKind.BLOCKED, index) for index in range(blocked)]
    met = [person for person in people if not person.false_stop]
    missed = [person.sustained_force for person in met if not person.stopped]
    late = 1e3 * np.percentile([person.latency for person in met if person.stopped], (50, 95, 100))
    hardest = f", {max(missed):.1f} N" if missed else ""
    return (
        f"{head} | {done.seconds:.0f} | {done.robot.servo.model.drive.gain:.0f} | "
        f"{stopped} of {free}, {len(people) - len(met)} before the touch | "
        f"{len(missed)} of {len(met)}{hardest} | {' / '.join(f'{each:.0f}' for each in late)} |"
    )


if __name__ == "__main__":
    main()
