"""How soon a partner at rest reacts: from a stimulus to 10 mm of a hand's or the head's travel.

    python bench/reaction.py --trials 40 > bench/reaction.txt

In the robot's own time, at the live partner's period and its default rest. Stimuli come at drawn
moments, in a pause or in the middle of an act.
"""

import argparse

import numpy as np

from miburi.bodies.simulated import Simulated
from miburi.feelings import FEELINGS, EmotionalModel, Stimulus, shipped_temperament
from miburi.partner import Partner
from miburi.robot import forward, iphonoid

STEP, FAR, LONGEST = 0.02, 0.01, 6.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    robot, rng = iphonoid(), np.random.default_rng(options.seed)
    print(f"{options.trials} trials each, seed {options.seed}: s to 10 mm; median, p90, latest")
    for feeling in FEELINGS:
        times = []
        for trial in range(options.trials):
            feelings = EmotionalModel(shipped_temperament("playful"))
            partner = Partner(Simulated(robot), feelings, life=trial, period=0.5)
            for _ in range(round(rng.uniform(2.0, 20.0) / STEP)):
                partner.step(STEP)
            feelings.stimulate(Stimulus(feeling, 0.9, "speech"))
            before = forward(robot, partner.body.state.angles).reshape(3, 3)
            took = 0.0
            while took < LONGEST:
                partner.step(STEP)
                took += STEP
                now = forward(robot, partner.body.state.angles).reshape(3, 3)
                if np.linalg.norm(now - before, axis=1).max() >= FAR:
                    break
            times.append(took)
        print(f"{feeling:10} {np.median(times):.2f} {np.quantile(times, 0.9):.2f} {max(times):.2f}")


if __name__ == "__main__":
    main()
