"""How well facts that are told in passing are kept, and found again, on lines by strangers.

    python bench/facts.py > bench/facts.txt

The lines are in bench/fact-lines. "Found again" asks each line's question when the facts of all
lines of that language are known.
"""

from collections import Counter
from pathlib import Path

from miburi.people.recall import recall
from miburi.talk.remembering import facts_in
from miburi.talk.script import script

LINES = Path(__file__).with_name("fact-lines")


def main() -> None:
    """Measure and print."""
    print("| | English | Japanese |\n|---|---|---|")
    columns = [measured(language) for language in ("en", "ja")]
    for row in columns[0]:
        print(f"| {row} | {' | '.join(column[row] for column in columns)} |")


def measured(language: str) -> dict[str, str]:
    """Return the figures of a language."""
    words = script(language)
    rows = [
        line.split("\t") for line in (LINES / f"{language}.tsv").read_text("utf-8").splitlines()
    ]
    facts = [row for row in rows if row[1]]
    kept = [(told, row[2]) for row in facts for told in facts_in(row[0], words)]
    others = [row for row in rows if not row[1]]
    wrong = sum(bool(facts_in(row[0], words)) for row in others)
    told = [fact for fact, _ in kept]
    found: Counter[str] = Counter()
    for _, _, question in facts:
        answer = recall(question, told, language)
        right = answer is not None and (answer, question) in kept
        found["nothing" if answer is None else "right" if right else "wrong"] += 1
    return {
        "told in passing, and kept": f"{len({question for _, question in kept})} of {len(facts)}",
        "kept by mistake from other remarks": f"{wrong} of {len(others)}",
        "found again": f"{found['right']} of {len(facts)}",
        "answered with another fact": f"{found['wrong']} of {len(facts)}",
    }


if __name__ == "__main__":
    main()
