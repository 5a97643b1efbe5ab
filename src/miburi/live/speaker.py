"""What a live partner says aloud: what it is told to say, and small answers of its own.

It also knows for how long it stays calm for somebody in distress.
"""

from miburi.feelings import Expression
from miburi.live.events.model import LiveEvent
from miburi.live.state import DistressOut, Spoken
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
        self._left: float | None = None  # s until the latest sentence has ended
        #: The wish that the sentence which is being said belongs to.
        self.wish: str | None = None

    @property
    def speaking(self) -> bool:
        """Whether the latest sentence is being said, as far as it knows: pages speak it."""
        return self._left is not None

    def attend(self, event: LiveEvent) -> None:
        """Be calm for a while, because of a distress in the log."""
        heard = {"kind": event.name, "words": event.text}
        numbers = {"number": event.number, "time": event.time}
        self.distress, self._calm = DistressOut.model_validate(heard | numbers), CALM

    def step(self, dt: float) -> bool:
        """Let ``dt`` s pass; return whether the latest sentence ends with that."""
        ended = self._left is not None and self._left <= dt
        self._left = None if ended or self._left is None else self._left - dt
        self._calm -= dt
        if self._calm <= 0:
            self.distress = None
        return ended

    def beats(self) -> float:
        """Return for how long its arms go with the latest sentence, s; 0 if short, or in calm."""
        seconds = self._left or 0.0
        return seconds if seconds >= _SHORT and self.distress is None else 0.0

    def say(self, text: str, felt: Expression | None, wish: str | None = None) -> Spoken:
        """Say a text in the voice of a feeling."""
        number = self.spoken.number + 1 if self.spoken else 1
        feeling = None if felt is None or self.distress is not None else felt.feeling
        language = language_of(text)
        self.spoken = Spoken(number=number, text=text, language=language, feeling=feeling)
        self._left, self.wish = len(text) / _LETTERS[language], wish
        return self.spoken

    def answer(self, heard: Impression, language: Language, felt: Expression | None) -> Spoken:
        """Answer what was heard."""
        text = self._answerer.answer(heard, felt, shipped_answers(language))
        return self.say(text, felt)
