"""What a live partner says aloud: what it is told to say, and small answers of its own.

It also knows for how long it stays calm for somebody in distress.
"""

from miburi.feelings import Expression
from miburi.live.state import DistressOut, Entry, Spoken
from miburi.senses import Impression
from miburi.senses.answers import Answerer, shipped_answers
from miburi.senses.language import Language, language_of

__all__ = ["CALM", "Speaker"]

#: s for which it is calm after a distress: it shows no feeling and wishes nothing.
CALM = 600.0

#: Letters that are spoken in a second (ours), and s below which nobody moves their arms to words.
_LETTERS: dict[Language, float] = {"en": 14.0, "ja": 7.0}
_SHORT = 2.0


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
        #: The latest distress, while it is calm for it.
        self.distress: DistressOut | None = None
        self._calm = 0.0  # s left

    def attend(self, entry: Entry) -> None:
        """Be calm for a while, because of a distress in the log."""
        heard = {"kind": entry.name, "words": entry.detail}
        numbers = {"number": entry.number, "time": entry.time}
        self.distress, self._calm = DistressOut.model_validate(heard | numbers), CALM

    def step(self, dt: float) -> bool:
        """Let ``dt`` s pass; return whether it is calm."""
        self._calm -= dt
        if self._calm <= 0:
            self.distress = None
        return self.distress is not None

    def time(self, spoken: Spoken) -> float:
        """Return about how long its arms go with a sentence, s; 0 for a short one, or in calm."""
        seconds = len(spoken.text) / _LETTERS[spoken.language]
        return seconds if seconds >= _SHORT and self.distress is None else 0.0

    def say(self, text: str, felt: Expression | None) -> Spoken:
        """Say a text in the voice of a feeling."""
        number = self.spoken.number + 1 if self.spoken else 1
        feeling = None if felt is None or self.distress is not None else felt.feeling
        language = language_of(text)
        self.spoken = Spoken(number=number, text=text, language=language, feeling=feeling)
        return self.spoken

    def answer(self, heard: Impression, language: Language, felt: Expression | None) -> Spoken:
        """Answer what was heard."""
        text = self._answerer.answer(heard, felt, shipped_answers(language))
        return self.say(text, felt)
