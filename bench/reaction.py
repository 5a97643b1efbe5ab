"""How soon a partner reacts: from a stimulus until a hand or the head is 10 mm off its course.

    python bench/reaction.py --trials 40 > bench/reaction.txt

Its course is what a twin does that gets no stimulus. In the robot's own time, at the live partner's
period and its default rest; the live loop adds up to 0.02 s. Stimuli of 0.9 come at drawn moments:
at rest, which is in a pause or amid an act (a breath, a glance), and during another feeling's
gesture, which is drawn and is as strong.
"""

import argparse

import numpy as np

from miburi.bodies.simulated import Simulated
from miburi.feelings import FEELINGS, EmotionalModel, Stimulus, shipped_temperament
from miburi.partner import Partner
from miburi.robot import forward, iphonoid

STEP, FAR, LONGEST = 0.02, 0.01, 6.0


def reaction(feeling: str, seed: int, trial: int, *, busy: bool) -> float:
    """Return the s until a partner at rest, or ``busy`` with another gesture, has reacted."""
    first, twin = (_waiting(feeling, seed, trial, busy=busy) for _ in range(2))
    first.feelings.stimulate(Stimulus(feeling, 0.9, "speech"))
    took, apart = 0.0, 0.0
    while took < LONGEST and apart < FAR:
        places = []
        for partner in (first, twin):
            partner.step(STEP)
            places.append(forward(partner.body.robot, partner.body.state.angles).reshape(3, 3))
        took += STEP
        apart = float(np.linalg.norm(places[0] - places[1], axis=1).max())
    return took


def _waiting(feeling: str, seed: int, trial: int, *, busy: bool) -> Partner:
    """Return a partner at a drawn moment of its rest, or of another feeling's gesture."""
    rng = np.random.default_rng([seed, FEELINGS.index(feeling), trial, busy])
    feelings = EmotionalModel(shipped_temperament("playful"))
    partner = Partner(Simulated(iphonoid()), feelings, life=trial, period=0.5)

    def wait(seconds: float) -> None:
        for _ in range(round(seconds / STEP)):
            partner.step(STEP)

    wait(rng.uniform(2.0, 20.0))
    if busy:
        others = [other for other in FEELINGS if other != feeling]
        feelings.stimulate(Stimulus(str(rng.choice(others)), 0.9, "speech"))
        wait(rng.uniform(0.3, 2.0))
    return partner


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=25)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    print(f"{options.trials} trials each, seed {options.seed}: s to 10 mm; median, p90, latest")
    print(f"{'':10} {'at rest':^16} {'in another gesture':^18}")
    for feeling in FEELINGS:
        cells = []
        for busy in (False, True):
            times = [
                reaction(feeling, options.seed, trial, busy=busy) for trial in range(options.trials)
            ]
            cells.append(f"{np.median(times):.2f} {np.quantile(times, 0.9):.2f} {max(times):.2f}")
        print(f"{feeling:10} {cells[0]:16} {cells[1]:18}")


if __name__ == "__main__":
    main()
