"""Train the linear model of what people ask: lines of strangers in, one small file out.

    python tools/train_intents.py [--out src/miburi/talk/intents.npz]

Needs SciPy (the extra ``studies``). The lines are those of ``intent-lines`` and ``order-lines``
beside this script, each behind what it asks for; strangers wrote them who knew neither patterns nor
answers. Everyday lines that ask the robot for nothing are those of the models of words and
distress. How well it does without the lines of some writers, ``train_network.py`` tells.
"""

import argparse
from collections.abc import Container
from pathlib import Path

import numpy as np
from linear_model import Model, fit
from train_distress import everyday, read_lines, strangers

from miburi.languages import plain
from miburi.senses.kinds import KINDS
from miburi.senses.linear import groups_of, numbered
from miburi.talk.asking import NOTHING

ROOT = Path(__file__).parents[1]
LINES = ("intent-lines", "order-lines")
SEED, NOTHINGS = 0, 4_000
#: How much the lines that ask for nothing weigh, of one class that asks for something.
SHARE = 6
KEPT = 15_000
#: 1 / strength of the penalty on large weights.
LOOSE = 40.0


def lines(without: Container[str] = ()) -> list[tuple[str, str]]:
    """Return what is asked for, and how; ``without`` names writers' files to leave out."""
    rows = [row for folder in LINES for row in read_lines(folder, "en", without)]
    found = [(kind.strip(), text.strip()) for kind, text in rows]
    rest = everyday() + [text for label, text in strangers("en", without) if label == len(KINDS)]
    random = np.random.default_rng(SEED)
    return found + [(NOTHING, rest[k]) for k in random.permutation(len(rest))[:NOTHINGS]]


def train(names: list[str], data: list[tuple[str, str]]) -> Model:
    """Return the model; each class weighs the same."""
    labels = np.array([names.index(kind) for kind, _ in data])
    share = 1 / np.bincount(labels)[labels] * np.where(labels == names.index(NOTHING), SHARE, 1)
    groups = [numbered(groups_of(plain(text, "en"), "en")) for _, text in data]
    return fit(groups, labels, share / share.mean(), "en", kept=KEPT, c=LOOSE) | {
        "en_names": np.array(names)
    }


def main() -> None:
    """Train, and write the file or check."""
    parser = argparse.ArgumentParser(description="Train the linear model of what people ask.")
    parser.add_argument("--out", type=Path, default=ROOT / "src/miburi/talk/intents.npz")
    wish = parser.parse_args()
    data = lines()
    names = sorted({kind for kind, _ in data})
    np.savez_compressed(wish.out, allow_pickle=False, **train(names, data))
    print(f"{wish.out}: {wish.out.stat().st_size} bytes")


if __name__ == "__main__":
    main()
