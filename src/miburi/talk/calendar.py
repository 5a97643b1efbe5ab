"""A language's words for days, times of day and numbers."""

import re
from collections.abc import Iterator
from datetime import datetime
from functools import cached_property
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from miburi.ground.placeholders import filled_with
from miburi.ground.tables import Table
from miburi.languages import Language, compile_phrases, is_spaced, plain

#: Operations on two numbers.
Sign = Literal["plus", "minus", "times", "by"]
_HUNDRED = 100
_CLOCK = ("hour", "hour12", "minute", "minutes", "half")


class Calendar(Table):
    """The part of a language's ``talk.toml`` that is about time and numbers.

    Attributes
    ----------
    words
        Named parts that patterns share.
    weekdays, months, days, clock, date
        Names of weekdays from Monday, and of months from January; ``days`` maps words such as
        "tomorrow" to a number of days; ``clock`` and ``date`` are the formats of times and dates.
        ``clock`` fills in {hour}, {hour12}, {minute} as two digits, {minutes} and {half} ("am" or
        "pm"), and ``date`` {weekday}, {day} and {month}.
    away
        Phrases for how far away a day is: today, tomorrow, or {days} days away.
    ordinals, dated
        Ordinal names of the days of a month, from the first, and regular expressions of a {day} of
        a {month} that use them. Without them, only digits are understood.
    later
        Regular expressions with a weekday ("a week on {day}"), and how many days after that weekday
        they mean.
    times, numbers, afternoon, span
        Regular expressions of a time of day (groups ``hour``, ``past`` and ``to`` for minutes, and
        ``half`` of the day); the values of number words; the word for the afternoon, such as "pm";
        and phrases for the time that is left.
    sums
        Regular expressions of the words between two numbers, by operation.
    """

    #: Set by :func:`miburi.talk.script.script`.
    language: Language = "en"
    words: dict[str, str] = Field(default_factory=dict)
    days: dict[str, Annotated[int, Field(ge=0, le=30)]]
    weekdays: Annotated[list[str], Field(min_length=7, max_length=7)]
    months: Annotated[list[str], Field(min_length=12, max_length=12)]
    clock: Annotated[str, AfterValidator(filled_with(**dict.fromkeys(_CLOCK, "9")))]
    date: Annotated[str, AfterValidator(filled_with(weekday="…", day=1, month="…"))]
    away: list[Annotated[str, AfterValidator(filled_with(days=1))]] = Field(default_factory=list)
    ordinals: list[str] = Field(default_factory=list)
    dated: list[str] = Field(default_factory=list)
    later: dict[str, Annotated[int, Field(ge=1, le=60)]] = Field(default_factory=dict)
    times: list[str] = Field(default_factory=list)
    numbers: dict[str, int] = Field(default_factory=dict)
    afternoon: str = "pm"
    span: dict[str, str] = Field(default_factory=dict)
    sums: dict[Sign, str] = Field(default_factory=dict)

    def times_in(self, words: str) -> Iterator[dict[str, str | None]]:
        """Yield the parts of each time of day in normalised text."""
        for pattern in self._times:
            for found in pattern.finditer(words):
                yield found.groupdict()

    @cached_property
    def _times(self) -> list[re.Pattern[str]]:
        return [compile_phrases([each], self.language, self.words) for each in self.times]

    @cached_property
    def plain_days(self) -> list[tuple[re.Pattern[str], int]]:
        """Patterns of the words in ``days``, the longest first, with their numbers of days."""
        words = sorted(self.days, key=len, reverse=True)
        return [(self._word(plain(word, self.language)), self.days[word]) for word in words]

    @cached_property
    def plain_weekdays(self) -> list[tuple[re.Pattern[str], str]]:
        """Patterns of the weekdays, from Monday, and their plain names."""
        spaced = is_spaced(self.language)
        names = [name if spaced else name.removesuffix("日") for name in self.weekdays]
        return [(self._word(name), name) for name in (plain(each, self.language) for each in names)]

    @cached_property
    def plain_months(self) -> list[str]:
        """The plain names of the months, from January."""
        return [plain(name, self.language) for name in self.months]

    def _word(self, word: str) -> re.Pattern[str]:
        return compile_phrases([re.escape(word)], self.language)

    def day_of(self, when: datetime) -> str:
        """Return a date as the language writes it."""
        month, weekday = self.months[when.month - 1], self.weekdays[when.weekday()]
        return self.date.format(weekday=weekday, day=when.day, month=month)

    def number(self, word: str | None) -> int | None:
        """Return the number for a number word or digits; None if there is none."""
        if word is None:
            return None
        return int(word) if word.isdecimal() else self.numbers.get(word)

    def count(self, words: str) -> int:
        """Return the number that several number words make, such as "two hundred sixteen"."""
        whole = 0
        for word in words.split():
            number = self.number(word) or 0
            whole = max(whole, 1) * number if number == _HUNDRED else whole + number
        return whole
