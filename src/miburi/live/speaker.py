"""What a live partner says aloud.

It also knows for how long it stays calm for somebody in distress.
"""

from miburi.feelings import Expression
from miburi.languages import language_of, letters_a_second
from miburi.live.events.model import LiveEvent
from miburi.live.state import DistressOut, Spoken, Tune

__all__ = ["CALM", "Speaker"]

#: s for which it is calm after a distress: it shows no feeling and wishes nothing.
CALM = 600.0

#: s below which nobody moves their arms to words.
_SHORT = 2.0


class Speaker:
    """Keeps the latest sentence; pages with their voice on speak it."""

    def __init__(self) -> None:
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

    def say(
        self,
        text: str,
        felt: Expression | None,
        wish: str | None = None,
        tune: Tune | None = None,
    ) -> Spoken:
        """Say a text in the voice of a feeling, or play a tune instead."""
        number = self.spoken.number + 1 if self.spoken else 1
        feeling = None if felt is None or self.distress is not None else felt.feeling
        language = language_of(text)
        self.spoken = Spoken(
            number=number, text=text, language=language, feeling=feeling, tune=tune
        )
        spoken_for = len(text) / letters_a_second(language)
        self._left = sum(seconds for _, seconds in tune) if tune else spoken_for
        self.wish = wish
        return self.spoken
