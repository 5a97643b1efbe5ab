"""A talk of sixty turns with the partner's own answers, as a judge reads it.

    python bench/talk.py tests/talk/scripts/en-1.txt

The scripts in tests/talk/scripts are by strangers who have seen no answer; nothing was chosen on
them. The partner feels what it hears, as the default temperament has it, and knows nobody at first.
The talk is held on Wednesday, November 25, from 10:00, half a minute a turn.
"""

import sys
from collections import Counter
from datetime import datetime, timedelta
from pathlib import Path

from miburi.feelings import EmotionalModel, shipped_temperament
from miburi.languages import language_of, with_whom
from miburi.people import Memory
from miburi.senses import stimuli
from miburi.senses.words import hear
from miburi.talk.answers import Answerer, is_needless
from miburi.talk.script import script


def talk(said: list[str]) -> list[str]:
    """Return the answers to some turns."""
    now = datetime(2026, 11, 25, 10)
    answerer, feelings = Answerer(1), EmotionalModel()
    memory = Memory(None, shipped_temperament(), lambda: now)
    language, answers = "en", []
    for turn in said:
        language = language_of(turn, language)
        heard = hear(turn, language)
        for stimulus in stimuli(heard, feelings.temperament):
            feelings.stimulate(stimulus)
        felt = feelings.express()
        known = {} if memory.present is None else {"name": memory.present.name}
        slots = {
            "told": memory.recall(turn, language),
            "latest": memory.kept(language, 1),
            "kept": memory.kept(language),
            "corrected": memory.corrected(turn, language),
            "before": memory.last_noted(),
        }
        known |= {slot: text for slot, text in slots.items() if text is not None}
        answer = answerer.answer(
            turn, heard, None if felt is None else felt.feeling, language, now, known
        )
        text = answer.text
        if heard.distress is not None:
            text = f"(help for {heard.distress})"
        elif heard.worry and not is_needless(heard.worry, script(language).intents_of(turn)):
            text = f"(a question whether it is an emergency: {heard.worry})"
        elif answer.do == "name" and answer.words:
            memory.meet(answer.words.capitalize())
        elif answer.do == "remember" and answer.words:
            fact = with_whom(answer.words, memory.noted(), language)
            memory.remember(fact, language, asked=True)
        elif answer.do == "amend" and answer.words:
            memory.amend(answer.words, language)
        elif answer.cue is None or answer.cue.aside:
            for fact in script(language).facts_in(turn):
                memory.remember(fact, language)
        plain = "" if heard.distress is not None else turn
        memory.note(plain, script(language).told_in(plain))
        answers.append(text)
        now += timedelta(seconds=30)
        feelings.step(30.0)
    return answers


def main() -> None:
    """Print the talk, and how often it repeats itself."""
    said = Path(sys.argv[1]).read_text(encoding="utf-8").splitlines()
    answers = talk(said)
    for turn, answer in zip(said, answers, strict=True):
        print(f"- {turn}\n  {answer}")
    often = Counter(answers).most_common(1)[0][1]
    print(
        f"\n{len(said)} turns, {len(set(answers))} different answers, none more than {often} times"
    )


if __name__ == "__main__":
    main()
