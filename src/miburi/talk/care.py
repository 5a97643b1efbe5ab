"""What a partner says to somebody in distress, and words that it never says.

For a kind of distress, a language and the user's region, :class:`Care` gives a calm sentence with
the help that fits. The words are in a language's ``care.toml``, and the telephone numbers in
``regions.toml``, beside this module.
"""

import re
import tomllib
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, TypeAdapter

from miburi.errors import InputError
from miburi.ground.placeholders import filled_with
from miburi.ground.tables import Table
from miburi.languages import (
    FALLBACK,
    Language,
    compile_phrases,
    find_phrase,
    language_of,
    plain,
    read,
)
from miburi.senses.distress import hear_distress
from miburi.senses.kinds import Distress, check_kinds

_CLAUSE = re.compile(r"[^,.!;:、。！]+")
_NUMBERS = dict.fromkeys(("medical", "fire", "police", "listening"), "112")
_Line = Annotated[str, Field(min_length=1, max_length=240), AfterValidator(filled_with(**_NUMBERS))]
_Lines = Annotated[list[_Line], Field(min_length=1)]


class Numbers(Table):
    """A region's emergency numbers, and a helpline."""

    medical: str
    fire: str
    police: str
    listening: str | None = None


class Follow(Table):
    """What somebody asks or says next in an emergency, and the answers to it.

    Attributes
    ----------
    kinds, when
        The kinds of distress that it may follow, and regular expressions of the words.
    say
        The answers, used in turn.
    """

    kinds: Annotated[list[Distress], Field(min_length=1)]
    when: Annotated[list[str], Field(min_length=1)]
    say: _Lines


class WordsOfCare(Table):
    """One language's ``care.toml``.

    Attributes
    ----------
    unknown, listener
        Words to use where no emergency number, or no helpline, is known.
    help, after
        Advice, by kind of distress, and lines for the ten minutes afterwards, used in turn.
    ask, yes, wonder, no
        Questions about possible distress, by kind, and regular expressions for a yes; questions
        after a slight sign, and regular expressions for a no. All four are empty in a language
        without a model of distress.
    follow, goes_on
        Answers to what is asked and said next, and regular expressions of other questions by
        somebody in need ("Should I …?").
    untrue, besides, misheard
        Regular expressions of clauses that deny distress, and of harmless clauses after them; and
        the replies.
    never, words
        Regular expressions of words that nobody may let the partner say; named parts that
        expressions share.
    """

    unknown: str
    listener: str
    after: _Lines
    ask: dict[Distress, _Lines] = Field(default_factory=dict)
    yes: list[str] = Field(default_factory=list)
    wonder: list[_Line] = Field(default_factory=list)
    no: list[str] = Field(default_factory=list)
    follow: list[Follow] = Field(default_factory=list)
    goes_on: list[str] = Field(default_factory=list)
    untrue: list[str]
    besides: list[str]
    words: dict[str, str] = Field(default_factory=dict)
    misheard: _Lines
    help: Annotated[dict[Distress, _Lines], AfterValidator(check_kinds)]
    never: list[str]


@dataclass(frozen=True)
class Care:
    """Chooses what a partner says to somebody in distress.

    Attributes
    ----------
    region
        A name in ``regions.toml``; with None the partner names no telephone number.
    """

    region: str | None = None

    def help(self, kind: Distress, language: Language, turn: int) -> str:
        """Return the help for this kind of distress; ``turn`` is how often it was said before."""
        return self._fill(words_of_care(language).help[kind], language, turn)

    def ask(self, kind: Distress, language: Language, turn: int) -> str:
        """Return a question that asks whether somebody needs help, with advice in case they do."""
        return self._fill(words_of_care(language).ask[kind], language, turn)

    def wonder(self, language: Language, turn: int) -> str:
        """Return a question that asks whether somebody is all right."""
        return self._fill(words_of_care(language).wonder, language, turn)

    def give_way(self, language: Language, turn: int) -> str:
        """Return the answer to a denial of distress."""
        return self._fill(words_of_care(language).misheard, language, turn)

    def stay(self, language: Language, turn: int) -> str:
        """Return a line for the ten minutes after distress."""
        return self._fill(words_of_care(language).after, language, turn)

    def follow(self, follow: Follow, language: Language, turn: int) -> str:
        """Return the answer to what is asked or said next."""
        return self._fill(follow.say, language, turn)

    def number(self, service: Literal["police", "listening"], language: Language) -> str:
        """Return a service's telephone number, or the words for an unknown one."""
        numbers = regions()[self.region] if self.region else None
        told = (getattr(numbers, service) or numbers.medical) if numbers else ""
        found = re.search(r"\d[\d -]*\d", told)
        return found.group() if found else words_of_care(language).unknown

    def _fill(self, lines: list[str], language: Language, turn: int) -> str:
        words = words_of_care(language)
        numbers = regions()[self.region] if self.region else None
        known = numbers.model_dump() if numbers else {}
        told = {name: known.get(name) or words.unknown for name in ("medical", "fire", "police")}
        listening = known.get("listening") or words.listener
        return lines[turn % len(lines)].format(**told, listening=listening)


def find_region(name: str) -> str:
    """Return a region's name as ``regions.toml`` spells it.

    Raises InputError if no region has that name.
    """
    if name.upper() not in regions():
        raise InputError(
            f"--region must be one of {', '.join(sorted(regions()))}, got {name!r}. Without a "
            "region, the partner names no emergency number."
        )
    return name.upper()


def agrees(text: str, language: Language) -> bool:
    """Whether a reply confirms that somebody needs help."""
    return find_phrase(_pattern("yes", language), plain(text, language), language) is not None


def denies(text: str, language: Language) -> bool:
    """Whether a reply says that somebody is not all right."""
    return find_phrase(_pattern("no", language), plain(text, language), language) is not None


def find_follow(text: str, kind: Distress, language: Language) -> Follow | None:
    """Return what a remark asks or says about an emergency of this kind, if it is known."""
    said = plain(text, language)
    fits = (one for one, words in _follows(language) if kind in one.kinds and words.search(said))
    return next(fits, None)


def goes_on(text: str, language: Language) -> bool:
    """Whether a remark asks what somebody in need should or may do."""
    return _pattern("goes_on", language).search(plain(text, language)) is not None


def takes_back(text: str, language: Language) -> bool:
    """Whether a remark ends by denying distress.

    "You misheard me, I said that he isn't breathing" does not.
    """
    if "?" in text or "？" in text:  # "Do you think it is a joke?"
        return False
    untrue, besides = _pattern("untrue", language), _pattern("besides", language)
    said = [words for each in _CLAUSE.findall(text) if (words := plain(each, language))]
    while said and besides.fullmatch(said[-1]):
        said.pop()
    return bool(said) and untrue.fullmatch(said[-1]) is not None


def may_be_said(text: str) -> bool:
    """Whether a language model's words may be spoken: no distress, nothing harmful or hurtful."""
    return not could_hurt(text) and hear_distress(text) is None


def could_hurt(text: str) -> bool:
    """Whether words are harmful or hurtful, whoever wants them spoken."""
    languages = {language_of(text), FALLBACK}
    return any(find_phrase(_pattern("never", each), plain(text, each), each) for each in languages)


@cache
def words_of_care(language: Language) -> WordsOfCare:
    """Return a language's ``care.toml``, or else the English one."""
    found = read(WordsOfCare, language, "care")
    return words_of_care(FALLBACK) if found is None else found


@cache
def regions() -> dict[str, Numbers]:
    """Return each region's numbers."""
    file = resources.files(__package__) / "regions.toml"
    numbers = tomllib.loads(file.read_text(encoding="utf-8"))
    return TypeAdapter(dict[str, Numbers]).validate_python(numbers)


@cache
def _pattern(
    name: Literal["yes", "no", "untrue", "besides", "never", "goes_on"], language: Language
) -> re.Pattern[str]:
    words = words_of_care(language)
    return compile_phrases(getattr(words, name) or ["(?!)"], language, words.words)


@cache
def _follows(language: Language) -> list[tuple[Follow, re.Pattern[str]]]:
    words = words_of_care(language)
    return [(one, compile_phrases(one.when, language, words.words)) for one in words.follow]
