"""Train the linear model of what people ask: lines of strangers in, one small file out.

    python tools/train_intents.py [--only ja] [--out src/miburi/talk/intents.npz]

Needs SciPy (the extra ``studies``). The lines are those of ``intent-lines`` and ``order-lines``
beside this script, each behind what it asks for; strangers wrote them who knew neither patterns nor
answers. Everyday lines that ask the robot for nothing are those of the models of words and
distress. How well it does without the lines of some writers, ``train_network.py`` tells.
"""

import argparse
from collections.abc import Container
from pathlib import Path

import numpy as np
from linear_model import LANGUAGES, Model, fit, save
from train_distress import everyday, read_lines, strangers

from miburi.languages import Language, plain
from miburi.senses.kinds import KINDS
from miburi.senses.linear import groups_of, numbered
from miburi.talk.asking import NOTHING

ROOT = Path(__file__).parents[1]
LINES = ("intent-lines", "order-lines")
SEED, NOTHINGS = 0, 4_000
#: How much the lines that ask for nothing weigh, of one class that asks for something.
SHARE = 6
KEPT = {"en": 15_000, "ja": 10_000}
#: 1 / strength of the penalty on large weights.
LOOSE = 40.0


def lines(language: Language, without: Container[str] = ()) -> list[tuple[str, str]]:
    """Return what is asked for, and how; ``without`` names writers' files to leave out."""
    rows = [row for folder in LINES for row in read_lines(folder, language, without)]
    found = [(kind.strip(), text.strip()) for kind, text in rows]
    harmless = [text for label, text in strangers(language, without) if label == len(KINDS)]
    rest = everyday(language) + harmless
    random = np.random.default_rng(SEED)
    return found + [(NOTHING, rest[k]) for k in random.permutation(len(rest))[:NOTHINGS]]


def names_of(language: Language) -> list[str]:
    """Return the names of what is asked for in a language's lines, in the order of the labels."""
    return sorted({name for name, _ in lines(language)})


def train(language: Language, without: Container[str] = ()) -> Model:
    """Return a language's model; each class weighs the same."""
    names, data = names_of(language), lines(language, without)
    labels = np.array([names.index(kind) for kind, _ in data])
    share = 1 / np.bincount(labels)[labels] * np.where(labels == names.index(NOTHING), SHARE, 1)
    groups = [numbered(groups_of(plain(text, language), language)) for _, text in data]
    kept = KEPT[language]
    return fit(groups, labels, share / share.mean(), language, kept=kept, c=LOOSE) | {
        f"{language}_names": np.array(names)
    }


def main() -> None:
    """Train, and write the file or check."""
    parser = argparse.ArgumentParser(description="Train the linear model of what people ask.")
    parser.add_argument("--out", type=Path, default=ROOT / "src/miburi/talk/intents.npz")
    parser.add_argument("--only", choices=LANGUAGES, help="keep the other language as it is")
    wish = parser.parse_args()
    save(wish.out, train, wish.only)


if __name__ == "__main__":
    main()
