"""Strips of a partner at rest, for judges who do not know what is which.

Pairs of two partners, this one and one of before, in a neutral mood:

    git clone -q . ../before && git -C ../before checkout -q d32d33f~1
    PYTHONPATH=../before/src python bench/rests.py record --out out/before.npy
    python bench/rests.py record --out out/now.npy
    python bench/rests.py pairs out/before.npy out/now.npy --out out/rests

One partner in three moods:

    python bench/rests.py moods --seed 1 --out out/moods

Each strip has 24 s of a pair, a still every second, or 18 s of a mood, a still every 1.5 s, with a
blank screen. The key beside the strips has what is which; bench/rests.txt has what judges said who
saw nothing else.
"""

import argparse
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from PIL import Image

from miburi.bodies.simulated import Simulated
from miburi.feelings import EmotionalModel
from miburi.partner import Partner
from miburi.robot import Array, iphonoid
from miburi.studies.film import Camera, Scene, camera, contact_sheet

STEP, SETTLED = 0.02, 30.0
PAIRS, SHOWN, APART = 20, 24.0, 1.0
MOODS, EACH, STRONG = ("happiness", "neutral", "sadness"), 4, 0.9
MOOD_SHOWN, MOOD_APART = 18.0, 1.5
PIXELS, MOOD_PIXELS, COLUMNS = 260, 300, 6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("record", "pairs", "moods"))
    parser.add_argument("recorded", type=Path, nargs="*", help="For pairs: before and now.")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    chosen = parser.parse_args()
    rng, out = np.random.default_rng(chosen.seed), chosen.out
    if chosen.what == "record":
        lives = rng.integers(1 << 30, size=PAIRS)
        np.save(out, [rest("neutral", int(life), SHOWN, APART) for life in lives])
        return
    out.mkdir(parents=True, exist_ok=True)
    key = []
    pixels = MOOD_PIXELS if chosen.what == "moods" else PIXELS
    with camera(iphonoid(), pixels, pixels) as eye:
        if chosen.what == "moods":
            for number, mood in enumerate(rng.permutation(MOODS * EACH).tolist(), start=1):
                seen = rest(mood, int(rng.integers(1 << 30)), MOOD_SHOWN, MOOD_APART)
                draw(eye, seen, out / f"{number:02}.png")
                key.append(f"{number:02} {mood}")
        else:
            rng.integers(1 << 30, size=PAIRS)  # as at the recording
            before, now = (np.load(path) for path in chosen.recorded)
            for number, swapped in enumerate(rng.integers(2, size=PAIRS), start=1):
                pair = (now, before) if swapped else (before, now)
                for letter, recorded in zip("AB", pair, strict=True):
                    draw(eye, recorded[number - 1], out / f"{number:02}{letter}.png")
                key.append(f"{number:02} now is {'BA'[swapped]}")
    (out / "key.txt").write_text("\n".join(key) + "\n", "utf-8")


def draw(eye: Camera, seen: Iterable[Array], path: Path) -> None:
    """Draw a strip of the joint angles (8,) of each still."""
    stills = [eye.picture(Scene(angles)) for angles in seen]
    Image.fromarray(contact_sheet(stills, COLUMNS)).save(path)


def rest(mood: str, life: int, shown: float, apart: float) -> list[Array]:
    """Return the joint angles (8,) of a resting partner every ``apart`` s, for ``shown`` s."""
    feelings = EmotionalModel()
    if mood != "neutral":
        feelings.set_state(mood={mood: STRONG}, hold=True)
    partner = Partner(Simulated(iphonoid()), feelings, life=life, period=0.5)
    seen = []
    for step in range(round((SETTLED + shown) / STEP)):
        partner.step(STEP)
        if step * STEP >= SETTLED and step % round(apart / STEP) == 0:
            seen.append(partner.body.state.angles)
    return seen


if __name__ == "__main__":
    main()
