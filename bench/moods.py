"""Strips of a partner at rest in three moods, for a judge who does not know which is which.

    python bench/moods.py --seed 1 --out out/moods

Each strip shows 18 s of rest, a still every 1.5 s, with a blank screen. The key beside the strips
has each one's mood; bench/moods.txt has what judges said who saw nothing else.
"""

import argparse
from pathlib import Path

import numpy as np
from PIL import Image

from miburi.bodies.simulated import Simulated
from miburi.feelings import EmotionalModel
from miburi.partner import Partner
from miburi.robot import Array, iphonoid
from miburi.studies.film import Scene, camera, contact_sheet

STEP, SETTLED, SHOWN, APART = 0.02, 30.0, 18.0, 1.5
MOODS = ("happiness", "neutral", "sadness")
#: How strong the mood is that is not neutral.
STRONG = 0.9
#: Strips of each mood.
EACH = 4
PIXELS, COLUMNS = 300, 6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("out/moods"))
    chosen = parser.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    rng, robot, key = np.random.default_rng(chosen.seed), iphonoid(), []
    with camera(robot, PIXELS, PIXELS) as eye:
        for number, mood in enumerate(rng.permutation(MOODS * EACH).tolist(), start=1):
            life = int(rng.integers(1 << 30))
            stills = [eye.picture(Scene(angles)) for angles in rest(mood, life)]
            Image.fromarray(contact_sheet(stills, COLUMNS)).save(chosen.out / f"{number:02}.png")
            key.append(f"{number:02} {mood}")
    (chosen.out / "key.txt").write_text("\n".join(key) + "\n", "utf-8")


def rest(mood: str, life: int) -> list[Array]:
    """Return the joint angles (8,) at each still of a partner that rests in a mood."""
    feelings = EmotionalModel()
    if mood != "neutral":
        feelings.set_state(mood={mood: STRONG}, hold=True)
    partner = Partner(Simulated(iphonoid()), feelings, life=life, period=0.5)
    seen = []
    for step in range(round((SETTLED + SHOWN) / STEP)):
        partner.step(STEP)
        if step * STEP >= SETTLED and step % round(APART / STEP) == 0:
            seen.append(partner.body.state.angles)
    return seen


if __name__ == "__main__":
    main()
