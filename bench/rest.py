"""How much a partner moves at rest, at each level: ten minutes each, in no emotion.

    python bench/rest.py --seed 1 > bench/rest.txt

Windows of 20 s are compared by the largest difference of any joint at any moment.
"""

import argparse

import numpy as np

from miburi.bodies.simulated import Simulated
from miburi.feelings import EmotionalModel, shipped_temperament
from miburi.feelings.temperament import REST_LEVELS
from miburi.partner import MoveSent, Partner, Stopped
from miburi.robot import iphonoid

STEP, MINUTES, WINDOW = 0.02, 10, 20.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    seed = parser.parse_args().seed
    robot = iphonoid()
    print(f"seed {seed}, {MINUTES} minutes each")
    for level in REST_LEVELS:
        temperament = shipped_temperament("playful").model_copy(update={"at_rest": level})
        partner = Partner(Simulated(robot), EmotionalModel(temperament), life=seed, period=0.5)
        angles, sent, moved, stops = [], [], 0, 0
        for step in range(round(MINUTES * 60 / STEP)):
            events = partner.step(STEP)
            sent += [step * STEP for event in events if isinstance(event, MoveSent)]
            stops += sum(isinstance(event, Stopped) for event in events)
            moved += partner.body.state.phase == "moving"
            angles.append(partner.body.state.angles)
        track = np.array(angles)
        windows = track.reshape(-1, round(WINDOW / STEP), 8)
        alike = min(
            np.abs(one - other).max()
            for index, one in enumerate(windows)
            for other in windows[index + 1 :]
        )
        gaps = np.diff(sent)
        gaps = gaps[gaps > 2.0]
        print(
            f"{level:6}  moved {moved / len(track):5.1%} of the time, {len(sent)} moves, "
            f"pauses {gaps.mean():.1f} s with a coefficient of variation of "
            f"{gaps.std() / gaps.mean():.2f}, {stops} stops; "
            f"the two most alike windows differ by {np.degrees(alike):.1f}°"
        )


if __name__ == "__main__":
    main()
