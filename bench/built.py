"""Check drawn robots as they would be built: every gesture at every mood, with the real shapes.

    python bench/built.py --robots 5 --seed 1 | tee bench/built.txt

Lengths are 0.8 to 1.5 times those of the buildable robot, every other one has a phone of 163 x 78
mm. A robot that cannot be built has one line that says why, and is drawn again.
"""

import argparse
import time

import numpy as np

from miburi.bodies.rehearsal import PERIOD, rehearse
from miburi.errors import InputError
from miburi.gestures import key_poses, load
from miburi.gestures.movement import shipped_feelings
from miburi.hardware.balance import description_masses, weights
from miburi.hardware.build import printed_parts
from miburi.hardware.check import check
from miburi.robot import Robot, buildable

#: Findings that are printed even if they are good.
SHOWN = {"torque standing", "torque moving", "tipping", "gestures", "joints", "stops"}
#: Every third pose is checked.
EACH = 3


def drawn(rng: np.random.Generator, number: int) -> Robot:
    robot = buildable()
    lengths = {
        key: value * rng.uniform(0.8, 1.5) for key, value in robot.lengths.model_dump().items()
    }
    # The foot is as high as the arms want it.
    arms = lengths["L23"] + lengths["L34"] + robot.shape.hand_radius
    shape = {"pedestal_height": max(robot.shape.pedestal_height, 0.035 + arms - lengths["L01"])}
    if number % 2:
        shape |= {"phone_height": 0.163, "phone_width": 0.078}
    return robot.model_copy(
        update={
            "lengths": robot.lengths.model_copy(update=lengths),
            "shape": robot.shape.model_copy(update=shape),
        }
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=int, default=5)
    parser.add_argument("--seed", type=int, default=1)
    wish = parser.parse_args()
    rng, built, refused = np.random.default_rng(wish.seed), 0, 0
    while built < wish.robots:
        robot = drawn(rng, built)
        size = ", ".join(f"{k} {1000 * v:.0f}" for k, v in robot.lengths.model_dump().items())
        try:
            began = time.perf_counter()
            parts = printed_parts(robot)
            took = time.perf_counter() - began
        except InputError as error:
            refused += 1
            print(f"not built: {str(error).splitlines()[-1].strip()}", flush=True)
            continue
        built += 1
        made = description_masses(weights(robot, parts)) | {"phone": robot.masses.phone}
        robot = robot.model_copy(update={"masses": robot.masses.model_copy(update=made)})
        motions = {
            f"{feeling} at {mood:.1f}": rehearse(
                robot, key_poses(robot, load(feeling), mood)
            ).angles[::EACH]
            for feeling in shipped_feelings()
            for mood in np.arange(0.1, 1.01, 0.1)
        }
        print(f"robot {built} (mm: {size}), parts in {took:.1f} s", flush=True)
        for found in check(robot, motions, EACH * PERIOD):
            if found.check in SHOWN or not found.ok:
                print(f"  {'ok' if found.ok else 'NO':3} {found.check}: {found.words}", flush=True)
    print(f"{built} built, {refused} refused.")


if __name__ == "__main__":
    main()
