"""How well the words sense hears, on sentences that it was never trained on.

    python bench/words.py --data FOLDER > bench/words.txt

FOLDER as for tools/train_words.py. Intervals are Wilson's, 95 %.
"""

import argparse
import sys
import time
from collections.abc import Callable
from itertools import pairwise
from math import sqrt
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "tools")]

from train_words import DATA, Rows, checked, read_goemotions, read_xed  # noqa: E402  (below the folder that holds it)

from miburi.senses.phrases import cut_smileys  # noqa: E402  (below the folder that holds it)
from miburi.senses.text import without_punctuation  # noqa: E402  (below the folder that holds it)
from miburi.senses.words import LABELS, SILENT, hear, judge, load_model  # noqa: E402  (below the folder that holds it)

SENTENCES = ROOT / "tests" / "senses"


def share(right: int, n: int) -> str:
    """A count, its share and its interval."""
    z = 1.96
    p = right / n
    middle, half = p + z * z / 2 / n, z * sqrt(p * (1 - p) / n + z * z / 4 / n / n)
    low, high = ((middle + sign * half) / (1 + z * z / n) for sign in (-1, 1))
    return f"{right}/{n} = {100 * p:.1f} % ({100 * max(low, 0):.0f}-{100 * high:.0f})"


def table(rows: Rows) -> None:
    """Precision, recall and F1 by feeling; the best guess counts, however unsure."""
    likely = np.array([judge(text)[-1] for text, _ in rows])
    guess = [LABELS[i] for i in likely.argmax(axis=1)]
    # Of several labels the one that was guessed counts, else the rarest.
    rarity = {name: sum(name in labels for _, labels in rows) for name in LABELS}
    truth = [
        g if g in labels else min(labels, key=lambda name: rarity[name])
        for g, (_, labels) in zip(guess, rows, strict=True)
    ]
    print(f"right: {share(sum(g == t for g, t in zip(guess, truth, strict=True)), len(rows))}")
    one = [(g, next(iter(ls))) for g, (_, ls) in zip(guess, rows, strict=True) if len(ls) == 1]
    print(f"of those with one label: {share(sum(g == t for g, t in one), len(one))}")
    f1 = []
    for name in LABELS:
        n, named = truth.count(name), guess.count(name)
        if n:
            both = sum(g == t == name for g, t in zip(guess, truth, strict=True))
            f1.append(2 * both / (n + named))
            print(
                f"  {name:10} n {n:5}  precision {both / max(named, 1):.2f}  "
                f"recall {both / n:.2f}  F1 {f1[-1]:.2f}"
            )
    print(f"macro-F1 {np.mean(f1):.3f}")
    print("strength of what it says against how often it is right:")
    best = likely[:, :-1].argmax(axis=1)
    strength = likely[np.arange(len(rows)), best]
    says = likely.argmax(axis=1) < len(LABELS) - 1
    for low, high in pairwise((SILENT, 0.5, 0.6, 0.75, 0.9, 1.01)):
        chosen = np.flatnonzero(says & (strength >= low) & (strength < high))
        right = sum(LABELS[best[i]] in rows[i][1] for i in chosen)
        if len(chosen):
            print(f"  {low:.2f}-{min(high, 1):.2f}  {share(right, len(chosen))}")


def utterances(name: str) -> list[tuple[str, str]]:
    """The labelled sentences of a file."""
    lines = (SENTENCES / name).read_text(encoding="utf-8").splitlines()
    return [(a, b) for a, _, b in (row.partition("\t") for row in lines if row[0] != "#")]


def half(rows: list[tuple[str, str]], kept: bool) -> list[tuple[str, str]]:
    """Every second row of each label is kept back."""
    number: dict[str, int] = {}
    chosen = []
    for label, text in rows:
        number[label] = number.get(label, 0) + 1
        if (number[label] % 2 == 0) == kept:
            chosen.append((label, text))
    return chosen


def everyday(rows: list[tuple[str, str]], change: Callable[[str], str] = str) -> None:
    """What :func:`hear` makes of them, silence and all."""
    heard = [(label, hear(change(text))) for label, text in rows]
    grave = sum(one.distress is not None for label, one in heard if label in LABELS[:-1])
    answers = [(label, one.feeling) for label, one in heard]
    felt = [(a, b) for a, b in answers if a in LABELS[:-1]]
    plain = [b for a, b in answers if a == "neutral"]
    denied = [(a[1:], b) for a, b in answers if a[0] == "-"]
    right = sum(a == b for a, b in felt)
    print(f"feelings right: {share(right, len(felt))}")
    print(f"  distress {grave}, silent {sum(b is None for _, b in felt) - grave}, another feeling "
          f"{sum(b not in (a, None) for a, b in felt)}")  # fmt: skip
    by = [f"{n} {sum(a == b == n for a, b in felt)}/{sum(a == n for a, _ in felt)}"
          for n in LABELS[:-1]]  # fmt: skip
    print(f"  {', '.join(by)}")
    guess = [(a, LABELS[int(judge(change(t))[-1].argmax())]) for a, t in rows]
    alone = sum(a == b for a, b in guess if a in LABELS[:-1])
    print(f"  the model's best guess alone, without the list of alarms: {share(alone, len(felt))}")
    print(f"neutral that move it: {share(sum(b is not None for b in plain), len(plain))}")
    kept = sum(a != b for a, b in denied)
    print(f"denied feelings not felt: {share(kept, len(denied))}")
    whole = right + sum(b is None for b in plain) + kept
    print(f"all: {share(whole, len(rows))}")


def count_strangers(path: Path) -> None:
    """Print what is heard in a stranger's lines."""
    rows = [row.split("\t") for row in path.read_text(encoding="utf-8").splitlines()]
    heard = [(label, hear(text)) for label, text in rows]
    felt = [label == one.feeling for label, one in heard if label in LABELS[:-1]]
    print(f"feelings right: {share(sum(felt), len(felt))}")
    joy = [one.feeling in ("happiness", "thrill") and one.strength > SILENT
           for label, one in heard if label == "sarcasm"]  # fmt: skip
    print(f"sarcasm taken for joy, above {SILENT:g}: {share(sum(joy), len(joy))}")
    for name in ("other", "past", "denied", "neutral"):
        moved = [one.feeling is not None for label, one in heard if label.startswith(name)]
        print(f"{name} taken for a feeling of one's own: {share(sum(moved), len(moved))}")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="Measure the words sense.")
    parser.add_argument("--data", type=Path, help="the folder of labelled sentences")
    parser.add_argument("--tuning", action="store_true", help="only the half for tuning")
    wish = parser.parse_args()
    rows = utterances("utterances.tsv")
    if wish.data:
        for name, digest in DATA.items():
            checked(wish.data / name, digest)
        part = "dev" if wish.tuning else "test"
        print(f"# GoEmotions, {part} split\n")
        comments = read_goemotions(wish.data, part)
        table(comments)
        print(f"\n# GoEmotions, {part} split, comments with a smiley\n")
        table([(text, labels) for text, labels in comments if cut_smileys(text)[1]])
        print(f"\n# XED, {part} split\n")
        table(read_xed(wish.data, part))
    sets = {"tuning half": half(rows, False)}
    if not wish.tuning:
        sets["kept-back half"] = half(rows, True)
        sets["a stranger's"] = utterances("utterances-stranger.tsv")
        sets["fresh"] = utterances("utterances-fresh.tsv")
    for name, some in sets.items():
        print(f"\n# Everyday utterances, {name}\n")
        everyday(some)
        print(f"\n# Everyday utterances, {name}, without punctuation\n")
        everyday(some, without_punctuation)
    if not wish.tuning:
        for path in sorted((ROOT / "bench" / "feelings-lines").glob("*.tsv")):
            print(f"\n# Strangers' lines, the {path.stem}\n")
            count_strangers(path)
    print("\n# Japanese, by stems (none kept back)\n")
    answers = [(a, hear(b).feeling) for a, b in utterances("utterances-ja.tsv")]
    felt = [a == b for a, b in answers if a in LABELS[:-1]]
    plain = [b is None for a, b in answers if a == "neutral"]
    denied = [a[1:] != b for a, b in answers if a[0] == "-"]
    for what, each in (("feelings", felt), ("neutral", plain), ("denied", denied)):
        print(f"{what} right: {share(sum(each), len(each))}")
    load_model.cache_clear()
    begin = time.process_time()
    load_model()
    loaded = time.process_time()
    for _ in range(10):
        for _, text in rows:
            hear(text)
    each = (time.process_time() - loaded) / len(rows) / 10
    print(f"\nload {1e3 * (loaded - begin):.0f} ms; {1e3 * each:.2f} ms an utterance (of one core)")


if __name__ == "__main__":
    main()
