"""A talk of sixty turns with the partner's own answers, as a judge reads it.

    python bench/talk.py tests/talk/scripts/en-1.txt

The scripts in tests/talk/scripts are by strangers who have seen no answer; nothing was chosen on
them. The live partner of the default temperament hears them, and knows nobody at first. The talk is
held on Wednesday, November 25, from 10:00, a remark every ten seconds.
"""

import asyncio
import sys
from collections import Counter
from datetime import datetime, timedelta
from pathlib import Path
from tempfile import TemporaryDirectory

from miburi.feelings import EmotionalModel, shipped_temperament
from miburi.live.recording.archive import Archive
from miburi.live.runner import STEP, Runner
from miburi.robot import iphonoid
from miburi.talk.care import Care
from miburi.talk.said import SayOut
from miburi.talk.speech import Speech

#: The time between remarks, s (ours).
EVERY = 10.0


async def talk(said: list[str]) -> list[SayOut]:
    """Return what came of some remarks."""
    now = datetime(2026, 11, 25, 10)
    came = []
    with TemporaryDirectory() as folder:
        feelings = EmotionalModel(shipped_temperament())
        runner = Runner(iphonoid(), feelings, Archive(Path(folder)))
        speech = Speech(runner, None, Care(), lambda: now)
        for remark in said:
            answer = asyncio.create_task(speech.take(remark))
            while not answer.done():
                runner.tick()
                await asyncio.sleep(0)
            came.append(answer.result())
            now += timedelta(seconds=EVERY)
            for _ in range(round(EVERY / STEP)):
                runner.tick()
    return came


def main() -> None:
    """Print the talk, and how often it repeats itself."""
    said = Path(sys.argv[1]).read_text(encoding="utf-8").splitlines()
    came = asyncio.run(talk(said))
    for remark, out in zip(said, came, strict=True):
        note = f"(help for {out.distress}) " if out.distress else ""
        note = f"(asks whether it is {out.worry}) " if out.worry else note
        print(f"- {remark}\n  {note}{out.answer}")
    answers = Counter(out.answer for out in came)
    often = max(answers.values())
    print(f"\n{len(said)} turns, {len(answers)} different answers, none more than {often} times")


if __name__ == "__main__":
    main()
