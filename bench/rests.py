"""Pairs of strips of two partners at rest, for a judge who does not know which is which.

    git clone -q . ../before && git -C ../before checkout -q d32d33f~1
    PYTHONPATH=../before/src python bench/rests.py record --out out/before.npy
    python bench/rests.py record --out out/now.npy
    python bench/rests.py pairs out/before.npy out/now.npy --out out/rests

Each strip shows 24 s of rest in a neutral mood, a still every second, with a blank screen; the key
beside the pairs has which is which. bench/rests.txt has what judges said who saw nothing else.
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

STEP, SETTLED, STILLS = 0.02, 30, 24
PAIRS = 20
PIXELS, COLUMNS = 260, 6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("record", "pairs"))
    parser.add_argument("recorded", type=Path, nargs="*", help="For pairs: before and now.")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    chosen = parser.parse_args()
    rng = np.random.default_rng(chosen.seed)
    lives = rng.integers(1 << 30, size=PAIRS)
    if chosen.what == "record":
        np.save(chosen.out, [rest(int(life)) for life in lives])
        return
    chosen.out.mkdir(parents=True, exist_ok=True)
    before, now = (np.load(path) for path in chosen.recorded)
    key = []
    with camera(iphonoid(), PIXELS, PIXELS) as eye:
        for number, swapped in enumerate(rng.integers(2, size=PAIRS), start=1):
            pair = (now, before) if swapped else (before, now)
            for letter, recorded in zip("AB", pair, strict=True):
                stills = [eye.picture(Scene(angles)) for angles in recorded[number - 1]]
                sheet = Image.fromarray(contact_sheet(stills, COLUMNS))
                sheet.save(chosen.out / f"{number:02}{letter}.png")
            key.append(f"{number:02} now is {'BA'[swapped]}")
    (chosen.out / "key.txt").write_text("\n".join(key) + "\n", "utf-8")


def rest(life: int) -> list[Array]:
    """Return the joint angles (8,) of a resting partner, once a second."""
    partner = Partner(Simulated(iphonoid()), EmotionalModel(), life=life, period=0.5)
    seen = []
    for step in range(round((SETTLED + STILLS) / STEP)):
        partner.step(STEP)
        if step * STEP >= SETTLED and step % round(1 / STEP) == 0:
            seen.append(partner.body.state.angles)
    return seen


if __name__ == "__main__":
    main()
