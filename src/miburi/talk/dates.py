"""Find the days and times in remarks: "tomorrow", "on Sunday", "on May 2nd", "at half two"."""

import re
from contextlib import suppress
from datetime import datetime, time, timedelta

from miburi.languages import Language, compile_phrases, plain
from miburi.talk.script import Script, script

#: The time of day at which a fact about a day is due (our choice).
_MORNING = time(9)
_NUMBER = re.compile(r"(?<!\d)([12]?\d|3[01])(?:st|nd|rd|th|er|日)?(?!\d)")


def local_time() -> datetime:
    """Return the local time of this computer."""
    return datetime.now().astimezone()


def due_of(said: str, language: Language, now: datetime) -> datetime | None:
    """Return the morning of the day that a sentence names, today or later; None if it names none.

    >>> due_of("Anna comes on Sunday.", "en", datetime(2026, 11, 25)).date().isoformat()
    '2026-11-29'
    >>> due_of("She was born on February 29th.", "en", datetime(2026, 11, 25)).date().isoformat()
    '2028-02-29'
    >>> due_of("It is on February 30th.", "en", datetime(2026, 11, 25))
    """
    words, text = script(language), plain(said, language)
    for pattern, days in words.plain_days:
        if pattern.search(text):
            return _morning(now + timedelta(days=days))
    for weekday, (pattern, name) in enumerate(words.plain_weekdays):
        if pattern.search(text):
            wait = (weekday - now.weekday() - 1) % 7 + 1 + _later(text, name, words)
            return _morning(now + timedelta(days=wait))
    for month, name in enumerate(words.plain_months, 1):
        if day := _day_of(name, text, words):
            return _next(now, month, day)
    return None


def date_of(said: str, told: str | None, language: Language, now: datetime) -> str | None:
    """Return the date in a remark, or else in a fact; None if neither names one.

    >>> date_of("What date is a week on Saturday?", None, "en", datetime(2026, 11, 25))
    'Saturday, December 5'
    """
    due = due_of(said, language, now) or due_of(told or "", language, now)
    return None if due is None else script(language).day_of(due)


def away(said: str, told: str | None, language: Language, now: datetime) -> str | None:
    """Return how far away the day or time is that a remark, or else a fact, names.

    Return None if neither names one.

    >>> away("How long is it till Sunday?", None, "en", datetime(2026, 11, 25))
    '4 days away'
    >>> away("How long till she comes?", "She comes at half two.", "en", datetime(2026, 11, 25, 10))
    '4 hours and 30 minutes away'
    """
    if told and not due_of(said, language, now):
        left = _left(said, language, now)
        if left is not None and left == _left(told, language, now):
            said = ""  # "nine fifteen" is the time in the fact "at nine fifteen tomorrow"
    for text in (said, told or ""):
        if due := due_of(text, language, now):
            days = (due.date() - now.date()).days
            if days and (words := script(language).away):
                return words[min(days, len(words) - 1)].format(days=days)
        if left := _left(text, language, now):
            return _span(left, language)
        if due and (words := script(language).away):
            return words[0]
    return None


def _left(said: str, language: Language, now: datetime) -> timedelta | None:
    """Return the time left until the time of day in a sentence; None if it names none.

    "Half past two" can be before or after noon: the next one is meant.
    """
    rules = script(language)
    for found in rules.times_in(plain(said, language)):
        hour, past, to, half = (found.get(part) for part in ("hour", "past", "to", "half"))
        clock = timedelta(hours=rules.number(hour) or 0)
        clock += timedelta(minutes=(rules.number(past) or 0) - (rules.number(to) or 0))
        every = timedelta(hours=24 if half or clock >= timedelta(hours=13) else 12)
        if half == rules.afternoon and clock < timedelta(hours=12):
            clock += timedelta(hours=12)
        today = timedelta(hours=now.hour, minutes=now.minute)
        return (clock - today) % every
    return None


def _span(left: timedelta, language: Language) -> str:
    words, minutes = script(language).span, round(left.total_seconds() / 60)
    parts: list[str] = []
    for unit, n in (("hour", minutes // 60), ("minute", minutes % 60)):
        if n or (unit == "minute" and not parts):
            parts.append(words[unit if n == 1 else f"{unit}s"].format(n=n))
    return words["away"].format(span=words["and"].join(parts))


def _later(text: str, weekday: str, words: Script) -> int:
    """Return the days to add to a weekday, as in "a week on Saturday"."""
    for phrase, days in words.later.items():
        if compile_phrases([phrase], words.language, {"day": weekday}).search(text):
            return days
    return 0


def _day_of(month: str, text: str, words: Script) -> int | None:
    if (place := text.find(month)) < 0:
        return None
    for day, name in reversed([*enumerate(words.ordinals, 1)]):  # "twenty first" before "first"
        if compile_phrases(words.dated, words.language, {"day": name, "month": month}).search(text):
            return day
    found = _NUMBER.search(f"{text[:place]} {text[place + len(month) :]}")
    return found and int(found.group(1))


def _next(now: datetime, month: int, day: int) -> datetime | None:
    for year in range(now.year, now.year + 9):  # February 29th may be eight years away
        with suppress(ValueError):
            due = _morning(now.replace(year=year, month=month, day=day))
            if due.date() >= now.date():
                return due
    return None


def _morning(day: datetime) -> datetime:
    return datetime.combine(day.date(), _MORNING, day.tzinfo)
