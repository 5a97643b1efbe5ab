"""Lists written by hand: despair, cries of alarm in English, and stems of Japanese words.

A sentence in, an impression out, with the phrase or the stems that spoke. The lists are
``despair.toml``, ``alarms.toml`` and ``stems-ja.toml``, beside this module.
"""

import re
import tomllib
import unicodedata
from functools import cache
from importlib import resources
from math import log
from typing import Annotated

from pydantic import Field

from miburi.feelings import FEELINGS
from miburi.feelings.catalogue import FeelingName
from miburi.feelings.temperament import Share
from miburi.ground.tables import Table
from miburi.senses.impression import Brought, Impression
from miburi.senses.text import tokens

__all__ = ["Alarms", "Despair", "Stems", "alarm_in", "despair_in", "stems_in"]

_DENIED = re.compile(r"\b(not|never|no)( \S+){0,3}$")


class Alarms(Table):
    """Cries that show fright: regular expressions over a sentence's words."""

    strength: Share
    cries: list[str]


class Despair(Table):
    """What people say who speak of ending their life: regular expressions by language."""

    strength: Share
    en: list[str]
    ja: list[str]


class Stems(Table):
    """Parts of Japanese words by feeling, and what denies them."""

    strength: Share
    denial: str
    reach: Annotated[int, Field(ge=1, le=20)]
    stems: dict[FeelingName, list[str]]


@cache
def _alarms() -> tuple[float, re.Pattern[str]]:
    alarms = Alarms.model_validate(_read("alarms.toml"))
    return alarms.strength, _whole_words(alarms.cries)


@cache
def _despair() -> tuple[float, re.Pattern[str], re.Pattern[str]]:
    despair = Despair.model_validate(_read("despair.toml"))
    return despair.strength, _whole_words(despair.en), re.compile("|".join(despair.ja))


@cache
def _stems() -> Stems:
    return Stems.model_validate(_read("stems-ja.toml"))


def _read(name: str) -> dict[str, object]:
    return tomllib.loads((resources.files(__package__) / name).read_text(encoding="utf-8"))


def _whole_words(phrases: list[str]) -> re.Pattern[str]:
    either = "|".join(f"(?:{phrase})" for phrase in phrases)
    return re.compile(rf"(?<!\S)(?:{either})(?!\S)")


def despair_in(text: str) -> Impression | None:
    """Return the sadness of who speaks of ending their life, in either language; else none."""
    strength, english, japanese = _despair()
    found = japanese.search(unicodedata.normalize("NFKC", text)) or _said(english, tokens(text))
    if found is None:
        return None
    why = Brought(found.group().strip(), round(_odds(strength), 2))
    return Impression("sadness", strength, "speech", (why,), grave=True)


def alarm_in(words: list[str]) -> Impression | None:
    """Return the fright of a sentence that cries, warns or calls for help; none of any other."""
    strength, cries = _alarms()
    found = _said(cries, words)
    if found is None:
        return None
    why = Brought(found.group().strip(), round(_odds(strength), 2))
    return Impression("fright", strength, "speech", (why,))


def _said(phrases: re.Pattern[str], words: list[str]) -> re.Match[str] | None:
    """Return the first phrase of a sentence that is not denied."""
    sentence = " ".join(word for word in words if word[0].isalnum())
    for match in phrases.finditer(sentence):
        if not _DENIED.search(sentence[: match.start()].rstrip()):
            return match
    return None


def stems_in(text: str) -> Impression:
    """Return what a Japanese sentence shows by the stems in it."""
    text, table = unicodedata.normalize("NFKC", text), _stems()
    denial = re.compile(table.denial)
    places: dict[str, dict[int, str]] = {}
    for feeling, stems in table.stems.items():
        for stem in (unicodedata.normalize("NFKC", stem) for stem in stems):
            for match in re.finditer(re.escape(stem), text):
                after = text[match.end() : match.end() + table.reach]
                if stem.endswith("ない") or not denial.match(after):
                    places.setdefault(feeling, {})[match.start()] = stem
    if not places:
        return Impression(None, 0.0, "speech")
    most = max(places, key=lambda feeling: (len(places[feeling]), -FEELINGS.index(feeling)))
    strength = 1 - (1 - table.strength) ** len(places[most])
    told = dict.fromkeys(places[most].values())
    weight = round(_odds(table.strength), 2)
    return Impression(most, strength, "speech", tuple(Brought(stem, weight) for stem in told))


def _odds(share: float) -> float:
    return log(share / (1 - share))
