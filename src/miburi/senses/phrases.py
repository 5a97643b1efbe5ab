"""Lists written by hand: cries of alarm in English, and stems of Japanese words.

A sentence in, an impression out, with the phrase or the stems that spoke. The lists are
``alarms.toml`` and ``stems-ja.toml``, beside this module.
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

__all__ = ["Alarms", "Stems", "alarm_in", "stems_in"]

_DENIED = re.compile(r"\b(not|never|no)( \S+){0,3}$")


class Alarms(Table):
    """Cries that show fright: regular expressions over a sentence's words."""

    strength: Share
    cries: list[str]


class Stems(Table):
    """Parts of Japanese words by feeling, and what denies them."""

    strength: Share
    denial: str
    reach: Annotated[int, Field(ge=1, le=20)]
    stems: dict[FeelingName, list[str]]


@cache
def _alarms() -> tuple[float, re.Pattern[str]]:
    alarms = Alarms.model_validate(_read("alarms.toml"))
    either = "|".join(f"(?:{cry})" for cry in alarms.cries)
    return alarms.strength, re.compile(rf"(?<!\S)(?:{either})(?!\S)")


@cache
def _stems() -> Stems:
    return Stems.model_validate(_read("stems-ja.toml"))


def _read(name: str) -> dict[str, object]:
    return tomllib.loads((resources.files(__package__) / name).read_text(encoding="utf-8"))


def alarm_in(words: list[str]) -> Impression | None:
    """Return the fright of a sentence that cries, warns or calls for help; none of any other."""
    strength, cries = _alarms()
    sentence = " ".join(word for word in words if word[0].isalnum())
    for match in cries.finditer(sentence):
        if not _DENIED.search(sentence[: match.start()].rstrip()):
            why = Brought(match.group().strip(), round(_odds(strength), 2))
            return Impression("fright", strength, "speech", (why,))
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
