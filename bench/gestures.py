"""Strips of the gestures without a face, for a judge who names in two words what they show.

    python bench/gestures.py --seed 1 --out out/gestures

Each gesture is shown at a mood of 0.9 and of 0.3: its first 4.4 s, a still every 0.4 s. The key
beside the strips has each one's feeling; bench/gestures.txt has what judges said who saw nothing
else.
"""

import argparse
from pathlib import Path

import numpy as np
from PIL import Image

from miburi.bodies.rehearsal import rehearse
from miburi.feelings import FEELINGS
from miburi.gestures import key_poses, load
from miburi.robot import iphonoid
from miburi.studies.gestures.pictures import camera_on, strip

MOODS = (0.9, 0.3)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("out/gestures"))
    parser.add_argument(
        "--files", type=Path, help="A folder of gesture files, for those that ship."
    )
    chosen = parser.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    rng, robot, key = np.random.default_rng(chosen.seed), iphonoid(), []
    with camera_on(robot) as camera:
        for mood in MOODS:
            for feeling in rng.permutation(FEELINGS).tolist():
                source = chosen.files / f"{feeling}.toml" if chosen.files else feeling
                name = f"{len(key) + 1:02}"
                performed = rehearse(robot, key_poses(robot, load(source), mood))
                Image.fromarray(strip(camera, performed)).save(chosen.out / f"{name}.png")
                key.append(f"{name} {feeling} {mood}")
    (chosen.out / "key.txt").write_text("\n".join(key) + "\n", "utf-8")


if __name__ == "__main__":
    main()
