"""Train the linear model of distress: written sentences in, one small file out.

    python tools/train_distress.py [--only ja] [--out src/miburi/senses/distress.npz]

Needs SciPy (the extra ``studies``). The sentences are drawn from ``distress-lessons.toml`` beside
this script, all written by one of Miburi's authors, and from ``distress-lines``, ``intent-lines``
and ``order-lines`` beside it, which strangers wrote. The model is a multinomial logistic
regression on groups of words and letters (:func:`miburi.senses.distress.features`). The patterns
that fit count as groups, too: train again after a change of a ``distress.toml``. The same sentences
give the same verdicts; the file's last bits depend on the versions of NumPy and SciPy.
"""

import argparse
import re
import tomllib
from collections.abc import Container
from pathlib import Path

import numpy as np
from linear_model import LANGUAGES, Model, fit, save

from miburi.languages import Language, plain
from miburi.senses.distress import features
from miburi.senses.kinds import KINDS

ROOT = Path(__file__).parents[1]
LESSONS = Path(__file__).with_name("distress-lessons.toml")
DRAWN = 48  # sentences from a line, at most
SEED = 31
KEPT = 20_000  # groups with the largest weights, by language
#: Kinds of question that are not taught as harmless.
GRAVE = {
    "advice", "alarm", "bad_person", "beyond", "call_doctor", "call_for_me", "can_you",
    "gets_easier", "medicine", "normal", "promise", "senses", "symptom", "them", "there",
    "understand",
}  # fmt: skip
#: Likewise, in a language that leaves out the subject: 玄関に誰かいる may be a cry for help.
VAGUE = {"ja": {"here_too", "if_emergency", "noise", "while_out", "witness"}}
#: One in this many of the other questions is taught. All the Japanese questions together took
#: weight from the look-alikes: 21 rather than 16 of a stranger's 200 were taken for a sign.
EVERY = {"en": 1, "ja": 4}
_CHOICE = re.compile(r"\(([^()]*)\)")


def draw(line: str, random: np.random.Generator) -> str:
    """Return one sentence of a line of choices."""
    while found := _CHOICE.search(line):
        options = found.group(1).split("|")
        chosen = options[int(random.integers(len(options)))]
        line = line[: found.start()] + chosen + line[found.end() :]
    return line


def sentences(language: Language, without: Container[str] = ()) -> list[tuple[int, str]]:
    """Return plain sentences, each once, by label; no distress is the last one.

    ``without`` names writers' files to leave out, as ``distress-lines/en-a``.
    """
    random = np.random.default_rng(SEED)
    lessons = tomllib.loads(LESSONS.read_text(encoding="utf-8"))[language]
    rows = {}
    for label, kind in enumerate((*KINDS, "none")):
        for line in lessons[kind]:
            for _ in range(DRAWN):
                rows[plain(draw(line, random), language)] = label
    for text in [*everyday(language), *questions(language, without)]:
        rows.setdefault(plain(text, language), len(KINDS))
    for label, text in strangers(language, without):
        rows[plain(text, language)] = label
    return [(label, text) for text, label in rows.items()]


def read_lines(folder: str, language: str, without: Container[str] = ()) -> list[list[str]]:
    """Return the label and text of each line that strangers wrote, but for some of their files."""
    files = sorted(LESSONS.with_name(folder).glob(f"{language}-*.tsv"))
    kept = [file for file in files if f"{folder}/{file.stem}" not in without]
    return [row.split("\t", 1) for file in kept for row in file.read_text("utf-8").splitlines()]


def strangers(language: Language, without: Container[str] = ()) -> list[tuple[int, str]]:
    """Return what strangers wrote, by label; their signs for everyday lines and stories are one."""
    labels = {kind: label for label, kind in enumerate(KINDS)}
    rows = read_lines("distress-lines", language, without)
    return [(labels.get(kind, len(KINDS)), text) for kind, text in rows]


def everyday(language: Language) -> list[str]:
    """Return what somebody says who only feels something, from the lessons of the words sense."""
    if language != "en":
        return []
    lessons = tomllib.loads(LESSONS.with_name("words-lessons.toml").read_text(encoding="utf-8"))
    alarms = ("fright", "fear")
    plain_ones = [one for name, one in lessons.items() if name not in alarms]
    said = [text for one in plain_ones for text in one["says"]]
    said += [f"I am {state}" for one in plain_ones for state in one.get("state", [])]
    for file in sorted(LESSONS.with_name("words-lines").glob("*.tsv")):
        rows = (row.split("\t") for row in file.read_text("utf-8").splitlines())
        said += [text for name, text in rows if name not in alarms]
    return said


def questions(language: Language, without: Container[str] = ()) -> list[str]:
    """Return what people ask of a partner, except the kinds that may well be grave."""
    folders = ("intent-lines", "order-lines")
    rows = [row for folder in folders for row in read_lines(folder, language, without)]
    grave = GRAVE | VAGUE.get(language, set())
    return [text for kind, text in rows if kind.strip() not in grave][:: EVERY[language]]


def train(language: Language, without: Container[str] = ()) -> Model:
    """Return a language's model; sentences of distress weigh as much as all others together."""
    rows = sentences(language, without)
    groups = [features(text, language) for _, text in rows]
    labels = np.array([label for label, _ in rows])
    none = labels == len(KINDS)
    share = np.where(none, 1 / none.sum(), 1 / (~none).sum()) * len(rows) / 2
    return fit(groups, labels, share, language, kept=KEPT)


def main() -> None:
    """Train each language and write the file."""
    parser = argparse.ArgumentParser(description="Train the linear model of distress.")
    parser.add_argument(
        "--out", type=Path, default=ROOT / "src" / "miburi" / "senses" / "distress.npz"
    )
    parser.add_argument("--only", choices=LANGUAGES, help="keep the other language as it is")
    wish = parser.parse_args()
    save(wish.out, train, wish.only)


if __name__ == "__main__":
    main()
