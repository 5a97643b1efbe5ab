"""Find the days and times in remarks: "tomorrow", "on Sunday", "on May 2nd", "at half two"."""

import re
from contextlib import suppress
from datetime import datetime, timedelta

from miburi.languages import Language, compile_phrases, plain
from miburi.people.records import MORNING
from miburi.talk.script import Script, script

#: "At three", or any time before seven, means the afternoon (our choice).
_EARLY, _HALF, _DAY = timedelta(hours=7), timedelta(hours=12), timedelta(hours=24)
_NUMBER = re.compile(r"(?<!\d)([12]?\d|3[01])(?:st|nd|rd|th|er|日)?(?!\d)")


def local_time() -> datetime:
    """Return the local time of this computer."""
    return datetime.now().astimezone()


def due_of(said: str, language: Language, now: datetime) -> datetime | None:
    """Return the day that a sentence names, today or later, at its time; None if it names no day.

    Without a time it is nine in the morning. The zone is this computer's, unless ``now`` has none.

    >>> due_of("Anna comes on Sunday at 3 pm.", "en", datetime(2026, 11, 25)).isoformat()
    '2026-11-29T15:00:00'
    >>> due_of("She was born on February 29th.", "en", datetime(2026, 11, 25)).isoformat()
    '2028-02-29T09:00:00'
    >>> due_of("It is on February 30th.", "en", datetime(2026, 11, 25))
    """
    text = plain(said, language)
    day = _day_in(text, language, now)
    if day is None:
        return None
    clock = MORNING
    for found in script(language).times_in(text):
        time_of_day, is_sure = _clock(found, script(language))
        if not is_sure and time_of_day < _EARLY:
            time_of_day += _HALF
        clock = (datetime.min + time_of_day % _DAY).time()
        break
    due = datetime.combine(day.date(), clock)
    return due if now.tzinfo is None else due.astimezone()  # with the offset of that date


def _day_in(text: str, language: Language, now: datetime) -> datetime | None:
    words = script(language)
    for pattern, days in words.plain_days:
        if pattern.search(text):
            return now + timedelta(days=days)
    for weekday, (pattern, name) in enumerate(words.plain_weekdays):
        if pattern.search(text):
            wait = (weekday - now.weekday() - 1) % 7 + 1 + _later(text, name, words)
            return now + timedelta(days=wait)
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
        if (left := _left(text, language, now)) and script(language).span:
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
        clock, is_sure = _clock(found, rules)
        today = timedelta(hours=now.hour, minutes=now.minute)
        return (clock - today) % (_DAY if is_sure else _HALF)
    return None


def _clock(found: dict[str, str | None], rules: Script) -> tuple[timedelta, bool]:
    """Return a time of day, and whether its half of the day is sure."""
    hour, past, to, half = (found.get(part) for part in ("hour", "past", "to", "half"))
    clock = timedelta(hours=rules.number(hour) or 0)
    clock += timedelta(minutes=(rules.number(past) or 0) - (rules.number(to) or 0))
    is_sure = half is not None or clock >= timedelta(hours=13)
    if half == rules.afternoon and clock < _HALF:
        clock += _HALF
    return clock, is_sure


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
            due = now.replace(year=year, month=month, day=day)
            if due.date() >= now.date():
                return due
    return None
