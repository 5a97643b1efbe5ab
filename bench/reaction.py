"""How soon a partner reacts: from a stimulus to 10 mm of a hand's or the head's travel.

    python bench/reaction.py --trials 100 > bench/reaction.txt

In the robot's own time, at the live partner's period and its default rest; the live loop adds up to
0.02 s. Stimuli of 0.9 come at drawn moments: at rest, which is in a pause or amid an act
(a breath, a glance), and during another feeling's gesture, which is drawn and is as strong. Travel
is the way that a hand or the head has gone, so a movement that turns round counts as well.
"""

import argparse

import numpy as np

from miburi.bodies.simulated import Simulated
from miburi.feelings import FEELINGS, EmotionalModel, Stimulus, shipped_temperament
from miburi.partner import Partner
from miburi.robot import forward, iphonoid

STEP, FAR, LONGEST = 0.02, 0.01, 6.0


def reaction(feeling: str, seed: int, trial: int, *, busy: bool) -> float:
    """Return the s until a partner at rest, or ``busy`` with another gesture, has moved."""
    rng = np.random.default_rng([seed, FEELINGS.index(feeling), trial, busy])
    robot, feelings = iphonoid(), EmotionalModel(shipped_temperament("playful"))
    partner = Partner(Simulated(robot), feelings, life=trial, period=0.5)

    def wait(seconds: float) -> None:
        for _ in range(round(seconds / STEP)):
            partner.step(STEP)

    wait(rng.uniform(2.0, 20.0))
    if busy:
        others = [other for other in FEELINGS if other != feeling]
        feelings.stimulate(Stimulus(str(rng.choice(others)), 0.9, "speech"))
        wait(rng.uniform(0.3, 2.0))
    feelings.stimulate(Stimulus(feeling, 0.9, "speech"))
    took, gone = 0.0, np.zeros(3)
    before = forward(robot, partner.body.state.angles).reshape(3, 3)
    while took < LONGEST and gone.max() < FAR:
        partner.step(STEP)
        took += STEP
        now = forward(robot, partner.body.state.angles).reshape(3, 3)
        gone += np.linalg.norm(now - before, axis=1)
        before = now
    return took


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    print(f"{options.trials} trials each, seed {options.seed}: s to 10 mm; median, p99, latest")
    print(f"{'':10} {'at rest':^16} {'in another gesture':^18}")
    for feeling in FEELINGS:
        cells = []
        for busy in (False, True):
            times = [
                reaction(feeling, options.seed, trial, busy=busy) for trial in range(options.trials)
            ]
            cells.append(f"{np.median(times):.2f} {np.quantile(times, 0.99):.2f} {max(times):.2f}")
        print(f"{feeling:10} {cells[0]:16} {cells[1]:18}")


if __name__ == "__main__":
    main()
