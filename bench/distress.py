"""How well distress is heard: by kind, on lines of our own, and on lines by strangers.

    python bench/distress.py > bench/distress.txt

Our own lines are tests/senses/distress-en.tsv and -ja.tsv; nothing was chosen on them. Those of
strangers are in bench/distress-lines. Intervals are Wilson's, 95 %. A line counts as heard if it is
taken for distress of any kind; "as that kind" says how often the kind is right, and "asked about"
counts those that may be distress and get a question.
"""

import sys
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "bench")]

from words import share  # noqa: E402  (below the folder that holds it)

from miburi.senses.distress import hear_distress, judge_distress  # noqa: E402  (below the folder that holds it)
from miburi.senses.kinds import KINDS  # noqa: E402  (below the folder that holds it)
from miburi.senses.text import without_punctuation  # noqa: E402  (below the folder that holds it)

#: Kinds that the strangers call otherwise.
THEIRS = {"breath": "breathing", "chest": "heart"}


def lines(language: str) -> list[tuple[str, str]]:
    """The labelled lines of a language."""
    file = ROOT / "tests" / "senses" / f"distress-{language}.tsv"
    rows = file.read_text(encoding="utf-8").splitlines()
    return [(kind, said) for kind, _, said in (row.partition("\t") for row in rows[1:])]


def main() -> None:
    """Measure and print."""
    for language in ("en", "ja"):
        rows = lines(language)
        begin = time.process_time()
        heard = [hear_distress(said) for _, said in rows]
        each = 1e3 * (time.process_time() - begin) / len(rows)
        print(f"# {language}\n\n| kind | heard | as that kind |\n|---|---|---|")
        total = right = n = 0
        for kind in KINDS:
            own = [h for h, (label, _) in zip(heard, rows, strict=True) if label == kind]
            taken, named = (
                sum(h is not None for h in own),
                sum((h and h.kind == kind) or 0 for h in own),
            )
            total, right, n = total + taken, right + named, n + len(own)
            print(f"| {kind} | {taken}/{len(own)} | {named}/{len(own)} |")
        print(f"| all | {share(total, n)} | {right}/{n} |\n")
        for sign, what in (("-", "everyday lines"), ("=", "stories, past, turns of phrase")):
            own = [h for h, (label, _) in zip(heard, rows, strict=True) if label == sign]
            print(f"{what} taken for distress: {share(sum(h is not None for h in own), len(own))}")
        bare = [hear_distress(without_punctuation(said)) for _, said in rows]
        same = sum(a == b for a, b in zip(heard, bare, strict=True))
        print(f"the same verdict without punctuation: {same}/{len(rows)}")
        print(f"{each:.2f} ms a line (of one core)\n")
        for writer in ("second", "third", "fourth", "fifth", "sixth"):
            print(f"## by strangers, the {writer}\n")
            count_strangers(writer, language)


def count_strangers(writer: str, language: str) -> None:
    """Print how many of a stranger's lines are taken for distress, and how many should be."""
    folder = ROOT / "bench" / "distress-lines" / writer
    for name, what in (
        ("grave", "distress heard"),
        ("household", "everyday lines taken for distress"),
        ("stories", "stories, past, what-ifs, look-alikes taken for distress"),
    ):
        file = folder / f"{name}-{language}.tsv"
        if not file.exists():
            continue
        rows = file.read_text(encoding="utf-8").splitlines()
        said = [row.split("\t")[-1] for row in rows]
        heard = [hear_distress(one) for one in said]
        bare = [hear_distress(without_punctuation(one)) for one in said]
        same = sum(a == b for a, b in zip(heard, bare, strict=True))
        doubted = [judge_distress(one) for one in said]
        asked = sum(one is not None and one.doubtful for one in doubted)
        print(f"{what}: {share(sum(h is not None for h in heard), len(said))}")
        print(f"asked about beside: {share(asked, len(said))}")
        if name == "grave":
            kinds = [THEIRS.get(kind, kind) for kind in (row.split("\t")[0] for row in rows)]
            right = sum(h is not None and h.kind == k for h, k in zip(heard, kinds, strict=True))
            print(f"as that kind: {right}/{len(said)}")
        print(f"the same verdict without punctuation: {same}/{len(said)}")
    print()


if __name__ == "__main__":
    main()
