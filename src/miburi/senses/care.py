"""What a partner says to somebody in distress, and what no language model may say through it.

In go a kind of distress, a language and the user's region; out comes a calm sentence with the help
that fits. The words are ``care-en.toml`` and ``care-ja.toml``, the numbers ``regions.toml``, and
what must not be said ``unsayable.toml``, beside this module.
"""

import re
import tomllib
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Annotated

from pydantic import Field, TypeAdapter

from miburi.errors import InputError
from miburi.ground.tables import Table
from miburi.senses.distress import compile_phrases, find_phrase, hear_distress, plain
from miburi.senses.kinds import Distress
from miburi.senses.language import Language, language_of

__all__ = [
    "Care",
    "Numbers",
    "WordsOfCare",
    "find_region",
    "may_be_said",
    "regions",
    "words_of_care",
]

_Line = Annotated[str, Field(min_length=1, max_length=240)]


class Numbers(Table):
    """A region's emergency numbers, and a line that listens."""

    medical: str
    fire: str
    police: str
    listening: str | None = None


class WordsOfCare(Table):
    """What one language's file holds: lines by kind, and those of the ten minutes after."""

    unknown: str
    listener: str
    after: list[_Line]
    help: dict[Distress, list[_Line]]


@dataclass(frozen=True)
class Care:
    """How a partner cares for somebody in distress.

    Attributes
    ----------
    region
        A name in ``regions.toml``; None: it names no number.
    """

    region: str | None = None

    def help(self, kind: Distress, language: Language, turn: int) -> str:
        """Return the help that fits; ``turn`` counts what has been said of it, from 0."""
        return self._fill(words_of_care(language).help[kind], language, turn)

    def stay(self, language: Language, turn: int) -> str:
        """Return what is said in the ten minutes after."""
        return self._fill(words_of_care(language).after, language, turn)

    def _fill(self, lines: list[str], language: Language, turn: int) -> str:
        words = words_of_care(language)
        numbers = regions()[self.region] if self.region else None
        known = numbers.model_dump() if numbers else {}
        told = {name: known.get(name) or words.unknown for name in ("medical", "fire", "police")}
        listening = known.get("listening") or words.listener
        return lines[turn % len(lines)].format(**told, listening=listening)


def find_region(name: str) -> str:
    """Return a region's name as it is written here.

    Raises
    ------
    InputError
        There is none of that name.
    """
    if name.upper() not in regions():
        raise InputError(
            f"--region must be one of {', '.join(sorted(regions()))}, got {name!r}. Without one it "
            "names no number."
        )
    return name.upper()


def may_be_said(text: str) -> bool:
    """Whether a language model's words may be spoken: no distress, no harm, nothing that hurts."""
    language = language_of(text)
    harm = find_phrase(_unsayable(language), plain(text, language), language)
    return harm is None and hear_distress(text) is None


@cache
def words_of_care(language: Language) -> WordsOfCare:
    """Return the words of a language; they are read once."""
    return WordsOfCare.model_validate(_read(f"care-{language}.toml"))


@cache
def regions() -> dict[str, Numbers]:
    """Return the regions' numbers; they are read once."""
    return TypeAdapter(dict[str, Numbers]).validate_python(_read("regions.toml"))


@cache
def _unsayable(language: Language) -> re.Pattern[str]:
    table = TypeAdapter(dict[Language, list[str]]).validate_python(_read("unsayable.toml"))
    return compile_phrases(table[language], language)


def _read(name: str) -> dict[str, object]:
    return tomllib.loads((resources.files(__package__) / name).read_text(encoding="utf-8"))
