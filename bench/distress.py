"""How well distress is heard: by kind, on lines of our own, and on lines by strangers.

    python bench/distress.py > bench/distress.txt

Our own lines are tests/senses/distress-en.tsv and -ja.tsv; nothing was chosen on them. Those of
strangers are in bench/distress-lines. Intervals are Wilson's, 95 %. A line counts as heard if it is
taken for distress of any kind; "asked about" counts, beside these, those that may be distress and
get a question; "a slight sign" those that get one only if there is another sign soon. The page
docs/senses.md shows these tables; a test compares them.
"""

import sys
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "bench")]

from words import share  # noqa: E402  (below the folder that holds it)

from miburi.senses.distress import Doubt, Heard, hear_distress, judge_distress  # noqa: E402  (below the folder that holds it)
from miburi.senses.kinds import KINDS  # noqa: E402  (below the folder that holds it)
from miburi.senses.text import without_punctuation  # noqa: E402  (below the folder that holds it)

#: Kinds that the strangers call otherwise.
THEIRS = {"breath": "breathing", "chest": "heart"}


def lines(language: str) -> list[tuple[str, str]]:
    """The labelled lines of a language."""
    file = ROOT / "tests" / "senses" / f"distress-{language}.tsv"
    rows = file.read_text(encoding="utf-8").splitlines()
    return [(kind, said) for kind, _, said in (row.partition("\t") for row in rows[1:])]


WRITERS = ("second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth")
#: What each writer's files hold. Writers without household lines wrote look-alikes as stories.
FILES = {
    "grave": "distress heard",
    "household": "*everyday lines taken for it*",
    "stories": "*stories, past, what-ifs taken for it*",
}
ALIKE = "*look-alikes taken for it*"


def main() -> None:
    """Measure and print."""
    own = {language: judged(lines(language)) for language in ("en", "ja")}
    print("# Lines of our own\n\n| kind | English | Japanese |\n|---|---|---|")
    for kind in (*KINDS, "all", "-", "="):
        columns = [found(rows, kind) for rows in own.values()]
        if any(columns):
            print(f"| {kind} | {' | '.join(columns)} |")
    for language, rows in own.items():
        begin = time.process_time()
        bare = [hear_distress(without_punctuation(said)) for _, said, _ in rows]
        each = 1e3 * (time.process_time() - begin) / len(rows)
        same = sum(a == told(b) for a, (_, _, b) in zip(bare, rows, strict=True))
        print(f"{language}: the same without punctuation: {same}/{len(rows)}; {each:.2f} ms a line")
    print("\n# Lines by strangers\n")
    print("| by the stranger | English | Japanese | asked about, English | Japanese "
          "| a slight sign, English | Japanese |")  # fmt: skip
    print("|---|---|---|---|---|---|---|")
    kinds = []
    for writer in WRITERS:
        folder = ROOT / "bench" / "distress-lines" / writer
        for name, what in FILES.items():
            if not (folder / f"{name}-en.tsv").exists():
                continue
            each_language = [judged(rows_of(folder / f"{name}-{one}.tsv")) for one in ("en", "ja")]
            heard = [share(sum(told(h) is not None for *_, h in rows), len(rows))
                     for rows in each_language]  # fmt: skip
            asked, slight = (
                [sum(h is not None and h.doubt is doubt for *_, h in rows) / len(rows)
                 for rows in each_language]
                for doubt in (Doubt.WORTH_A_QUESTION, Doubt.SLIGHT_SIGN))  # fmt: skip
            alike = name == "stories" and not (folder / "household-en.tsv").exists()
            columns = [*heard, *(f"{100 * one:.1f} %" for one in asked + slight)]
            print(f"| {writer}: {ALIKE if alike else what} | {' | '.join(columns)} |")
            if name == "grave":
                right = [sum(told(h) is not None and h.kind == THEIRS.get(k, k) for k, _, h in rows)
                         for rows in each_language]  # fmt: skip
                kinds.append(f"{writer} {right[0]} and {right[1]}")
    print(f"\nas the right kind, in English and in Japanese: {', '.join(kinds)}")


def rows_of(file: Path) -> list[tuple[str, str]]:
    """The lines of a file, with their labels where they have some."""
    rows = file.read_text(encoding="utf-8").splitlines()
    return [(row.split("\t")[0], row.split("\t")[-1]) for row in rows]


def judged(rows: list[tuple[str, str]]) -> list[tuple[str, str, Heard | None]]:
    """Lines with what is heard in them."""
    return [(kind, said, judge_distress(said)) for kind, said in rows]


def told(heard: Heard | None) -> Heard | None:
    """Return what is taken for distress rather than asked about."""
    return None if heard is None or heard.doubt else heard


def found(rows: list[tuple[str, str, Heard | None]], kind: str) -> str:
    """How many lines of a kind are heard as it; of all, or of harmless ones, as any."""
    if kind in KINDS:
        own = [told(heard) for label, _, heard in rows if label == kind]
        return f"{sum(h is not None for h in own)}/{len(own)}" if own else ""
    own = [
        told(heard)
        for label, _, heard in rows
        if (label in KINDS if kind == "all" else label == kind)
    ]
    return share(sum(h is not None for h in own), len(own))


if __name__ == "__main__":
    main()
