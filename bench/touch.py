"""A hand that moves a robot at rest: when it notices, what it presses with, how it goes back.

    python bench/touch.py > bench/touch.txt

The description's robot, and robots as from a workshop, each calibrated as its maker would. A stiff
hand comes at 0.1 m/s from four sides and goes 10 or 30 mm on after it has met a hand of the robot,
or its phone from both sides; forces are those from 0.5 s after the hand has stopped. Then each
robot rests, lively, for ten minutes without a hand.
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from itertools import product

import numpy as np

from miburi.bodies.plant import Plant
from miburi.bodies.simulated import READING, Simulated
from miburi.feelings import EmotionalModel, shipped_temperament
from miburi.partner import Partner, Stopped
from miburi.robot import Robot, iphonoid
from miburi.robot.specimens import specimens
from miburi.safety.free import FreeRule
from miburi.safety.stop import StopReason
from miburi.studies.trials.plant import TrialPlant, Variation
from miburi.studies.trials.workshop import calibrate_servos

SPEED, MINUTES = 0.1, 10
FRONT_AND_SIDES = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)]
PLACES = [
    *product(("right_hand", "left_hand"), FRONT_AND_SIDES, (0.01, 0.03)),
    *product(("phone",), FRONT_AND_SIDES[2:], (0.01, 0.03)),
]
Push = tuple[float, float, float]  # s to the stop, N after it, rad/s of the return


def body_of(robot: Robot, rule: FreeRule, true: Robot, *, placed: bool) -> Simulated:
    if placed:
        plant = Plant(true)
        plant.robot = robot
    else:
        plant = TrialPlant(robot, true)
        plant.begin(np.array(robot.neutral), Variation(), np.random.default_rng(0))
    return Simulated(robot, rule, plant=plant)


def push(body: Simulated, part: str, side: tuple[int, int, int], depth: float) -> Push:
    """Push once, and let go."""
    for _ in range(30):
        body.read()
    plant = body._plant
    place = plant.data.geom(part).xpos.copy()
    direction = np.array(side, dtype=float)
    along = np.array([0.0, 1.0, 0.0]) if side[1] == 0 else np.array([1.0, 0.0, 0.0])
    way, met, began = -0.1, None, 0.0
    while met is None or way < met + depth:
        way += SPEED * READING
        body.place_hand(place + direction * way, along)
        state = body.step(READING)
        if met is None and body.touch.began is not None:
            met, began = way, state.time
    rests = [(body.step(READING), body.touch) for _ in range(150)]
    force = max(touch.force for _, touch in rests[50:])
    stop = body.state.stop
    if stop is None:
        return np.nan, force, np.nan
    if stop.reason is not StopReason.TOUCHED:
        raise AssertionError(f"{part} from {side} by {depth} m: {stop}")
    body.remove_hand()
    for _ in range(200):
        body.read()
    body.release()
    fastest = 0.0
    while body.phase == "returning":
        fastest = max(fastest, float(np.abs(body.step(READING).velocities).max()))
    return stop.time - began, force, fastest


def one(number: int, robots: int, seed: int) -> tuple[list[Push], int]:
    robot = iphonoid()
    if number == 0:
        rule, true = FreeRule.of(robot), robot
    else:
        done = calibrate_servos(robot, seed, specimens(robot, seed, robots)[number - 1].robot)
        robot, rule, true = done.robot, done.rule, done.true
    pushes = [push(body_of(robot, rule, true, placed=True), *place) for place in PLACES]
    body = body_of(robot, rule, true, placed=False)
    temperament = shipped_temperament("playful").model_copy(update={"at_rest": "lively"})
    partner = Partner(body, EmotionalModel(temperament), life=number, period=0.5)
    events = [e for _ in range(MINUTES * 3000) for e in partner.step(0.02)]
    false = sum(isinstance(event, Stopped) for event in events)
    return pushes, false


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    for name, default in (("robots", 12), ("seed", 3), ("workers", 2)):
        options.add_argument(f"--{name}", type=int, default=default)
    chosen = options.parse_args()
    count = chosen.robots + 1
    with ProcessPoolExecutor(chosen.workers) as pool:
        found = list(pool.map(one, range(count), [chosen.robots] * count, [chosen.seed] * count))
    each = np.array([push for pushes, _ in found for push in pushes])
    led = each[~np.isnan(each[:, 0])]
    print(
        f"{count} robots, {len(each)} pushes, {len(led)} noticed; a hand that was not noticed",
        end=" ",
    )
    print(f"is pressed with {each[np.isnan(each[:, 0]), 1].max(initial=0.0):.2f} N at most")
    for name, column, unit in (
        ("noticed after", 0, "s"),
        ("presses", 1, "N"),
        ("back", 2, "rad/s"),
    ):
        low, high, most = np.percentile(led[:, column], (50, 95, 100))
        print(f"{name}: median {low:.2f}, 95 % below {high:.2f}, at most {most:.2f} {unit}")
    print(f"stops in {count * MINUTES / 60:g} h of lively rest: {sum(false for _, false in found)}")


if __name__ == "__main__":
    main()
