"""Servos that are hot or worn, under the rule for new and cold ones, and after a calibration.

    python bench/servos/worn.py [--free 60] [--blocked 20] [--seed 61]

Hot motors have a fifth more resistance, worn gears 1.85 times the friction. Trials have 4.75 to
5.25 V and 0.75 to 1.25 times that friction besides.
"""

import argparse

from miburi.errors import BodyError
from miburi.robot import Robot, iphonoid
from miburi.safety.contact import Rule
from miburi.safety.free import FreeRule
from miburi.studies.trials.plant import TrialPlant
from miburi.studies.trials.trial import TrialKind, trial
from miburi.studies.trials.workshop import calibrate_servos

ROBOTS = {"hot": (1.0, 1.2), "worn": (1.85, 1.0), "worn and hot": (1.85, 1.2)}


def built(friction: float, resistance: float) -> Robot:
    """Return the iphonoid with so many times the friction and resistance of its description."""
    servo = iphonoid().servo.model.varied(friction=friction)
    motor = servo.motor.model_copy(update={"resistance": servo.motor.resistance * resistance})
    return iphonoid().with_servo(servo.model_copy(update={"motor": motor}))


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    for name, default in (("free", 60), ("blocked", 20), ("seed", 61)):
        options.add_argument(f"--{name}", type=int, default=default)
    chosen = options.parse_args()
    print("| | free stopped | stopped before the touch | missed | gain |\n|---|---|---|---|---|")
    for name, factors in ROBOTS.items():
        robot, true = iphonoid(), built(*factors)
        show(name, TrialPlant(robot, true), FreeRule.of(robot), chosen)
        try:
            done = calibrate_servos(robot, 1, true)
        except BodyError as error:
            print(f"| {name}, calibrated | refused: {error} |")
            continue
        show(f"{name}, calibrated", TrialPlant(done.robot, done.true), done.rule, chosen)


def show(name: str, plant: TrialPlant, rule: Rule, chosen: argparse.Namespace) -> None:
    free, blocked = (
        [trial(plant, rule, chosen.seed, kind, index) for index in range(count)]
        for kind, count in ((TrialKind.FREE, chosen.free), (TrialKind.BLOCKED, chosen.blocked))
    )
    print(
        f"| {name} | {sum(one.stopped for one in free)} of {chosen.free} "
        f"| {sum(one.false_stop for one in blocked)} of {chosen.blocked} "
        f"| {sum(not one.stopped for one in blocked)} "
        f"| {plant.robot.servo.model.drive.gain:g} |",
        flush=True,
    )


if __name__ == "__main__":
    main()
