"""What a live partner says aloud: what it is told to say, and small answers of its own."""

from miburi.feelings import Expression
from miburi.live.state import Spoken
from miburi.senses import Impression
from miburi.senses.answers import Answerer, shipped_answers
from miburi.senses.language import Language, language_of

__all__ = ["Speaker", "speaking_time"]

#: Letters that are spoken in a second (ours), and s below which nobody moves their arms to words.
_LETTERS: dict[Language, float] = {"en": 14.0, "ja": 7.0}
_SHORT = 2.0


def speaking_time(spoken: Spoken) -> float:
    """Return about how long its arms go with a sentence, s; 0 for a short one."""
    seconds = len(spoken.text) / _LETTERS[spoken.language]
    return seconds if seconds >= _SHORT else 0.0


class Speaker:
    """Keeps the latest sentence; pages with their voice on speak it.

    Parameters
    ----------
    seed
        Chooses among small answers.
    """

    def __init__(self, seed: int) -> None:
        self._answerer = Answerer(seed)
        #: The latest sentence.
        self.spoken: Spoken | None = None

    def say(self, text: str, felt: Expression | None) -> Spoken:
        """Say a text in the voice of a feeling."""
        number = self.spoken.number + 1 if self.spoken else 1
        feeling = None if felt is None else felt.feeling
        language = language_of(text)
        self.spoken = Spoken(number=number, text=text, language=language, feeling=feeling)
        return self.spoken

    def answer(self, heard: Impression, language: Language, felt: Expression | None) -> Spoken:
        """Answer what was heard."""
        text = self._answerer.answer(heard, felt, shipped_answers(language))
        return self.say(text, felt)
