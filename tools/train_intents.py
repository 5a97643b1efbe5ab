"""Train the linear model of what people ask: lines of strangers in, one small file out.

    python tools/train_intents.py [--out src/miburi/talk/intents.npz] [--check]

Needs SciPy (the extra ``studies``). The lines are those of ``intent-lines`` and ``order-lines``
beside this script, each behind what it asks for; strangers wrote them who knew neither patterns nor
answers. Everyday lines that ask the robot for nothing are those of the models of words and
distress. ``--check`` trains without a fifth of the lines, and tells how many of these it then takes
for what they are.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
from linear_model import Model, fit
from train_distress import everyday, strangers

from miburi.languages import plain
from miburi.senses.kinds import KINDS
from miburi.senses.linear import groups_of, load_model, numbered
from miburi.talk.asking import NOTHING

ROOT = Path(__file__).parents[1]
LINES = [Path(__file__).with_name(name) for name in ("intent-lines", "order-lines")]
SEED, NOTHINGS = 0, 4_000
#: How much the lines that ask for nothing weigh, of one class that asks for something.
SHARE = 6
KEPT = 36_000
#: 1 / strength of the penalty on large weights.
LOOSE = 40.0


def lines() -> list[tuple[str, str]]:
    """Return what is asked for, and how."""
    files = [file for folder in LINES for file in sorted(folder.glob("en-*.tsv"))]
    rows = [row.split("\t") for file in files for row in file.read_text("utf-8").splitlines()]
    found = [(kind.strip(), text.strip()) for kind, text in rows]
    rest = everyday() + [text for label, text in strangers("en") if label == len(KINDS)]
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


def check(names: list[str], data: list[tuple[str, str]], folder: Path) -> None:
    """Train without every fifth line, and judge these."""
    kept, left = [row for k, row in enumerate(data) if k % 5], data[::5]
    file = folder / "intents.npz"
    np.savez_compressed(file, allow_pickle=False, **train(names, kept))
    judge = load_model(file, "en")
    assert judge is not None
    likely = np.array([judge(numbered(groups_of(plain(text, "en"), "en"))) for _, text in left])
    best, sure = likely.argmax(axis=1), likely.max(axis=1)
    true = np.array([names.index(kind) for kind, _ in left])
    nothing = names.index(NOTHING)
    for least in (0.0, 0.3, 0.7):
        told = (sure > least) & (best != nothing)
        asks = true != nothing
        print(
            f"above {least}: of {asks.sum()} that ask, {(told & asks).sum()} found, "
            f"{(told & asks & (best == true)).sum()} rightly; "
            f"of {(~asks).sum()} that do not, {(told & ~asks).sum()} found"
        )


def main() -> None:
    """Train, and write the file or check."""
    parser = argparse.ArgumentParser(description="Train the linear model of what people ask.")
    parser.add_argument("--out", type=Path, default=ROOT / "src/miburi/talk/intents.npz")
    parser.add_argument("--check", action="store_true")
    wish = parser.parse_args()
    data = lines()
    names = sorted({kind for kind, _ in data})
    if wish.check:
        with tempfile.TemporaryDirectory() as folder:
            check(names, data, Path(folder))
        return
    np.savez_compressed(wish.out, allow_pickle=False, **train(names, data))
    print(f"{wish.out}: {wish.out.stat().st_size} bytes")


if __name__ == "__main__":
    main()
