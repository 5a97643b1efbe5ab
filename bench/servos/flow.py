"""Moves that replace one another, on robots as they leave a workshop: false stops and full stops.

    python bench/servos/flow.py [--robots 12] [--minutes 4] [--seed 3] > bench/servos/flow.txt

A lively partner hears another drawn feeling every 1 to 5 s, so that gestures are broken off in
mid-move; each robot is calibrated as its maker would. Before that, how often each gesture comes to
a full stop on its way, as the paper performs it and as a lively partner does; and what a stiff hand
feels that gets into the right hand's way, 0.15 s before it comes there.
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from itertools import repeat

import numpy as np

from miburi.bodies.simulated import Simulated
from miburi.errors import BodyError
from miburi.feelings import FEELINGS, EmotionalModel, Stimulus
from miburi.partner import MoveSent, Partner, Stopped
from miburi.robot import forward, iphonoid
from miburi.robot.specimens import specimens
from miburi.safety.stop import Phase
from miburi.studies.trials.plant import TrialPlant
from miburi.studies.trials.workshop import calibrate_servos

STEP = 0.02
#: A joint that is slower than this is still, rad/s.
STILL = 0.02


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    for name, default in (("robots", 12), ("minutes", 4), ("seed", 3), ("workers", 2)):
        options.add_argument(f"--{name}", type=int, default=default)
    chosen = options.parse_args()
    print("gesture at 0.9   full stops as in the paper, lively   arms' correlation")
    for feeling in FEELINGS:
        (stiff, _), (free, together) = (one_gesture(feeling, life) for life in (None, 1))
        print(f"{feeling:12} {stiff:6} {free:6} {together:10.2f}", flush=True)
    print("hands in the way   stopped, missed (2 N over 0.1 s)   s to the stop: median, p95, most")
    for life in (None, 1):
        print(f"{'lively' if life else 'as in the paper':18} {met_hands(life)}", flush=True)
    print("robot   moves, of them within another   contacts   with its own parts", flush=True)
    each = (chosen.robots, chosen.seed, chosen.minutes)
    with ProcessPoolExecutor(chosen.workers) as pool:
        for line in pool.map(alive, range(-1, chosen.robots), *map(repeat, each)):
            print(line, flush=True)


def one_gesture(feeling: str, life: int | None) -> tuple[int, float]:
    """Return how often all joints stand still within a gesture, and how alike both arms move."""
    partner, _ = shown(feeling, life)
    while partner.expression is None:
        partner.step(STEP)
    speeds, angles = [], []
    while partner.expression is not None:
        partner.step(0.01)
        course = partner.body.course()
        speeds.append(np.abs(course.velocities).max())
        angles.append(course.angles)
    still = np.array(speeds) < STILL
    stops = int(np.sum(np.diff(still.astype(int)) == 1)) - 1  # the last one is at rest
    own = np.array(angles)
    pairs = [(1, 4, 1), (2, 5, -1), (3, 6, -1)]
    alike = [np.corrcoef(own[:, a], sign * own[:, b])[0, 1] for a, b, sign in pairs]
    return max(stops, 0), float(np.nanmean(alike))


def met_hands(life: int | None) -> str:
    """Let hands be in the way of free gestures at many moments, and say what came of it."""
    waits, missed = [], 0
    for feeling in ("happiness", "thrill", "surprise"):
        for when in np.linspace(0.6, 3.4, 29):
            took, longest = met_hand(feeling, float(when), life)
            missed += took is None and longest > 0.1
            waits += [] if took is None else [took]
    late = np.quantile(waits, (0.5, 0.95, 1.0))
    seconds = " ".join(f"{quantile:.2f}" for quantile in late)
    return f"{len(waits):4} {missed:4}      {seconds}"


def met_hand(feeling: str, when: float, life: int | None) -> tuple[float | None, float]:
    """Return s from the first touch to the stop, and s of the longest press over 2 N."""
    free, _ = shown(feeling, life)
    while free.body.state.time < when + 0.15:
        free.step(0.01)
    body = free.body
    place = forward(body.robot, body.state.angles)[:3]
    partner, body = shown(feeling, life)
    touched, pressed, longest = None, 0.0, 0.0
    while body.state.time < when + 1.5:
        before = body.state.time
        partner.step(0.01)
        if before < when <= body.state.time:
            body.place_hand(place, np.array([1.0, 0.0, 0.0]))
        force = body.touch.force
        if force > 0 and touched is None:
            touched = body.state.time
        pressed = pressed + 0.01 if force > 2 else 0.0
        longest = max(longest, pressed)
        if body.phase is Phase.STOPPED and touched is not None:
            return body.state.time - touched, longest
    return None, longest


def shown(feeling: str, life: int | None) -> tuple[Partner, Simulated]:
    feelings, body = EmotionalModel(), Simulated(iphonoid())
    feelings.set_state(emotion={feeling: 1.0}, mood={feeling: 0.9}, hold=True)
    return Partner(body, feelings, life=life, period=0.5), body


def made(number: int, robots: int, seed: int) -> Simulated:
    """Return a robot of a workshop, calibrated as its maker would; −1: the one as described."""
    robot = iphonoid()
    if number < 0:
        return Simulated(robot)
    done = calibrate_servos(robot, seed, specimens(robot, seed, robots)[number].robot)
    return Simulated(done.robot, done.rule, plant=TrialPlant(done.robot, done.true))


def alive(number: int, robots: int, seed: int, minutes: int) -> str:
    name = "as described" if number < 0 else str(number)
    try:
        body = made(number, robots, seed)
    except BodyError as error:
        return f"{name:12} refused: {error}"
    feelings, rng = EmotionalModel(), np.random.default_rng([seed, number + 1])
    partner = Partner(body, feelings, life=seed, period=0.5)
    moves = within = contacts = own = 0
    due = 1.0
    met = False
    while body.state.time < 60 * minutes:
        if body.state.time >= due:
            feelings.stimulate(Stimulus(rng.choice(FEELINGS), float(rng.uniform(0.5, 1)), "speech"))
            due += float(rng.uniform(1.0, 5.0))
        moving = body.phase is Phase.MOVING
        for event in partner.step(STEP):
            moves += isinstance(event, MoveSent)
            within += isinstance(event, MoveSent) and moving
            contacts += isinstance(event, Stopped)
            own += isinstance(event, Stopped) and met
        met = body.touch.itself is not None
    return f"{name:12} {moves:6} {within:6} {contacts:10} {own:6}"


if __name__ == "__main__":
    main()
