"""Whether it asks in time: runs of three remarks in which somebody hints at distress, or is well.

    python bench/hints.py > bench/hints.txt

Two strangers wrote the runs in bench/hints, 40 of each kind each, with words that could sound
grave in the calm ones ("I'm dying for a cup of tea"); nothing was chosen on them. A new partner
hears each run, one remark every ten seconds. This takes about two minutes.
"""

import asyncio
from pathlib import Path

from miburi.talk.care import words_of_care
from talk import talk

RUNS = Path(__file__).with_name("hints")


def main() -> None:
    """Count the runs by the most that came of them."""
    wonders = set(words_of_care("en").wonder)
    print('| runs | taken for distress | asked about | "Are you all right?" | none of these |')
    print("|---|---|---|---|---|")
    for file in sorted(RUNS.glob("*.txt"), reverse=True):
        runs = [run.splitlines() for run in file.read_text(encoding="utf-8").split("\n\n")]
        counts = [0, 0, 0, 0]
        for run in runs:
            came = asyncio.run(talk(run))
            signs = [any(one.distress for one in came), any(one.worry for one in came),
                     any(one.answer in wonders for one in came), True]  # fmt: skip
            counts[signs.index(True)] += 1
        print(f"| {file.stem} | {' | '.join(f'{one}/{len(runs)}' for one in counts)} |")


if __name__ == "__main__":
    main()
