"""The rhythm of a spoken text: its duration, and the times of its prominent syllables.

For voices that report no timing, such as a browser's, the letters give an estimate. If the times of
the vowels are known, the letters only decide which vowels are stressed. Each language's
``rhythm.toml`` has the numbers and the patterns.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Annotated

from pydantic import Field

from miburi.ground.tables import Table
from miburi.languages import FALLBACK, Language, read

_Seconds = Annotated[float, Field(ge=0, le=2)]


@dataclass(frozen=True)
class Rhythm:
    """The timing of a spoken text.

    Attributes
    ----------
    prominent
        The midpoints of the stressed vowels in s from the start, ascending.
    seconds
        The duration in s.
    """

    prominent: tuple[float, ...]
    seconds: float


class _Table(Table):
    """A language's durations in s, patterns of stress, and weak words."""

    letter: _Seconds
    syllable: _Seconds
    begins: _Seconds
    comma: _Seconds
    stop: _Seconds
    word: str
    vowel: str
    second: str = ""
    third: str = ""
    last: bool = False
    light: str = ""

    @cached_property
    def tokens(self) -> re.Pattern[str]:
        return re.compile(
            rf"(?P<word>{self.word})|(?P<stop>[.!?…。！？]+(?!\w))|(?P<comma>[,;:—–、]+)"
        )

    @cached_property
    def vowels(self) -> re.Pattern[str]:
        return re.compile(self.vowel)

    @cached_property
    def later(self) -> list[tuple[str, int]]:
        """Beginnings of words that move the stress, with the index of the stressed syllable."""
        return [(one, 2) for one in self.third.split()] + [(one, 1) for one in self.second.split()]

    @cached_property
    def weak(self) -> re.Pattern[str]:
        either = "|".join(self.light.split())
        return re.compile(f"(?:{either})" if either else "(?!)")


@cache
def _table(language: Language) -> _Table:
    found = read(_Table, language, "rhythm")
    return _table(FALLBACK) if found is None else found


def rhythm_of(text: str, language: Language, rate: float = 1.0) -> Rhythm:
    """Return the rhythm of a text, said ``rate`` times as fast as usual.

    >>> said = rhythm_of("Anna is coming.", "en")
    >>> [round(at, 1) for at in said.prominent], round(said.seconds, 1)
    ([0.2, 0.8], 1.1)
    """
    phrases, seconds = _phrases(text, _table(language))
    prominent = (one.at / rate for phrase in phrases for one in phrase if one.stands_out)
    return Rhythm(tuple(prominent), seconds / rate)


def rhythm_of_sound(
    text: str, language: Language, vowels: Sequence[Sequence[float]], seconds: float
) -> Rhythm:
    """Return the rhythm of a text whose sound is known.

    Parameters
    ----------
    vowels
        The midpoints of the vowels in s from the start, for each phrase between two silences.
    seconds
        How long the sound takes, in s.
    """
    phrases, _ = _phrases(text, _table(language))
    if len(phrases) != len(vowels):  # a pause without a punctuation mark, or the reverse
        phrases = [[one for phrase in phrases for one in phrase]]
        vowels = [[at for stretch in vowels for at in stretch]]
    prominent = [
        stretch[round(k * (len(stretch) - 1) / max(len(phrase) - 1, 1))]
        for phrase, stretch in zip(phrases, vowels, strict=True)
        for k, one in enumerate(phrase)
        if one.stands_out and stretch
    ]
    return Rhythm(tuple(sorted(set(prominent))), seconds)


@dataclass(frozen=True)
class _Syllable:
    at: float
    stands_out: bool


def _phrases(text: str, table: _Table) -> tuple[list[list[_Syllable]], float]:
    """Return the syllables of each phrase between punctuation, and the total duration in s."""
    at, pause = table.begins, 0.0
    phrases: list[list[_Syllable]] = []
    for token in table.tokens.finditer(text.lower().replace("’", "'")):
        word = token["word"]
        if word is None:
            pause = max(pause, table.stop if token["stop"] else table.comma)
            continue
        if pause or not phrases:
            phrases.append([])
        at, pause = at + (pause if len(phrases) > 1 else 0.0), 0.0
        middles = [sum(vowel.span()) / 2 for vowel in table.vowels.finditer(word)] or [0.0]
        strong = None if table.weak.fullmatch(word) else _stressed(word, middles, table)
        took = table.letter * len(word) + table.syllable * len(middles)
        phrases[-1] += [
            _Syllable(at + took * middle / len(word), k == strong)
            for k, middle in enumerate(middles)
        ]
        at += took
    return phrases, at


def _stressed(word: str, middles: list[float], table: _Table) -> int:
    """Return the index of a word's stressed syllable: as listed, else first or last."""
    if table.last:
        return len(middles) - 1
    later = (k for stem, k in table.later if word.startswith(stem))
    return min(next(later, 0), len(middles) - 1)
