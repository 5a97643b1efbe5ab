"""What a live partner says aloud, and how long it stays calm for somebody in distress."""

from itertools import accumulate

from miburi.feelings import Expression
from miburi.feelings.catalogue import CATALOGUE
from miburi.languages import language_of
from miburi.languages.rhythm import Rhythm, rhythm_of
from miburi.live.events.event import LiveEvent
from miburi.live.state import DistressOut, Spoken, Tune
from miburi.serving.press import By

#: How long the partner stays calm after distress, in s. While it is calm, it shows no feeling and
#: starts nothing by itself.
CALM = 600.0

#: The arms do not beat to a sentence or a tune that is shorter than this, in s.
_SHORT = 2.0


class Speaker:
    """Keeps the latest sentence, which pages say aloud if their voice is on."""

    def __init__(self) -> None:
        #: The latest sentence.
        self.spoken: Spoken | None = None
        #: The latest distress, while the partner stays calm because of it.
        self.distress: DistressOut | None = None
        self._calm = 0.0  # s left
        self._left: float | None = None  # s until the end of the latest sentence
        self._rhythm, self._chirp, self._long = Rhythm((), 0.0), 0.0, False
        #: The wish for the present sentence, and who asked for it.
        self.wish: str | None = None
        self.by: By | None = None

    @property
    def speaking(self) -> bool:
        """Whether a page is probably still saying the latest sentence, by its estimated length."""
        return self._left is not None

    def attend(self, event: LiveEvent) -> None:
        """Stay calm for a while, because of an event of distress."""
        heard = {"kind": event.name, "words": event.text}
        numbers = {"number": event.number, "time": event.time}
        self.distress, self._calm = DistressOut.model_validate(heard | numbers), CALM

    def forget_words(self) -> None:
        """Forget what somebody in distress said."""
        if self.distress is not None:
            self.distress = self.distress.model_copy(update={"words": None})

    def step(self, dt: float) -> bool:
        """Advance by ``dt`` s; return whether the latest sentence ends in that time."""
        ended = self._left is not None and self._left <= dt
        self._left = None if ended or self._left is None else self._left - dt
        self._calm -= dt
        if self._calm <= 0:
            self.distress = None
        return ended

    def sounds(self, number: int, rhythm: Rhythm) -> bool:
        """Keep the rhythm of a sentence's sound; return False if it is not the present sentence.

        The sound begins when the sentence's introductory chirp ends, or now if the chirp is over.
        """
        spoken = self.spoken
        if self._left is None or spoken is None or spoken.number != number or spoken.tune:
            return False
        said = self._rhythm.seconds - self._left
        begins = max(self._chirp - said, 0.0)
        self._rhythm, self._long = _later(rhythm, begins), rhythm.seconds >= _SHORT
        self._left = self._rhythm.seconds
        return True

    def beats(self) -> tuple[float, ...]:
        """Return the times at which the arms beat, in s and in ascending order.

        The times count from the latest call of ``say`` or ``sounds``. Beats fall on prominent
        syllables or on a tune's notes. There are none if the sentence is short, or while the
        partner is calm after distress.
        """
        return self._rhythm.prominent if self._long and self.distress is None else ()

    def say(
        self,
        text: str,
        felt: Expression | None,
        wish: str | None,
        tune: Tune | None = None,
        by: By | None = None,
    ) -> Spoken:
        """Say a text in a voice coloured by a feeling, or play a tune instead."""
        number = self.spoken.number + 1 if self.spoken else 1
        feeling = None if felt is None or self.distress is not None else felt.feeling
        language = language_of(text)
        self.spoken = Spoken(
            number=number, text=text, language=language, feeling=feeling, tune=tune
        )
        voice = CATALOGUE.voice(feeling)
        self._chirp = sum(seconds for _, seconds in voice.chirp)
        said = _of_tune(tune) if tune else rhythm_of(text, language, voice.rate)
        self._rhythm = said if tune else _later(said, self._chirp)
        self._long = said.seconds >= _SHORT
        self._left, self.wish, self.by = self._rhythm.seconds, wish, by
        return self.spoken


def _of_tune(tune: Tune) -> Rhythm:
    ends = tuple(accumulate(seconds for _, seconds in tune))
    return Rhythm((0.0, *ends[:-1]), ends[-1])


def _later(rhythm: Rhythm, by: float) -> Rhythm:
    return Rhythm(tuple(by + at for at in rhythm.prominent), by + rhythm.seconds)
