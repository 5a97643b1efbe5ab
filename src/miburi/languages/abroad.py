"""Calls for help and orders to stop in languages that have no folder.

In fear or pain, people may use another language than the one that was chosen for the partner. The
words are in ``abroad.toml``.
"""

import re
import tomllib
import unicodedata
from collections.abc import Collection
from functools import cache, lru_cache
from importlib import resources
from typing import Literal, NamedTuple

from miburi.ground.tables import Table
from miburi.languages.files import Language, folders

#: How many characters of a remark count; some letters stand for 18 plain ones.
_LONGEST = 1000
_LETTERS = str.maketrans({"ı": "i", "ø": "o", "æ": "ae", "đ": "d", "ł": "l"})
_UMLAUTS = str.maketrans({"ä": "ae", "ö": "oe", "ü": "ue", "å": "aa", "ø": "oe"})
_CLAUSE = re.compile(r"[.,!?;:…—。、！？،\n]+")
#: Scripts that leave no space between words: Thai, kana and Han.
_UNSPACED = re.compile(r"[\u0e00-\u0e7f\u3040-\u30ff\u3400-\u9fff]")


class _Abroad(Table):
    """The words, by the code of their language."""

    cry: dict[Language, list[str]]
    call: dict[Language, list[str]]
    whole: dict[Language, list[str]]
    stop: dict[Language, list[str]]
    moving: dict[Language, list[str]]
    beside: dict[Language, list[str]]
    no: dict[Language, list[str]]
    thanks: dict[Language, list[str]]
    yes: dict[Language, list[str]]


class _Patterns(NamedTuple):
    calls: re.Pattern[str]
    called: re.Pattern[str]  # a clause of calls and words beside them
    foreign: re.Pattern[str]  # the same of calls that English does not have
    whole: re.Pattern[str]
    cried: re.Pattern[str]  # a cry at either end
    thanks: re.Pattern[str]
    stop: re.Pattern[str]
    moving: re.Pattern[str]
    order: re.Pattern[str]  # for a moving body, with a word that English does not have
    yes: re.Pattern[str]


def calls_for_help(said: str, *, unknown: bool) -> Literal["surely", "perhaps"] | None:
    """Return whether a remark calls for help in a language without a folder.

    In a remark of ``unknown`` words, a call need not stand alone. There "help" is a call, too.

    >>> [calls_for_help(said, unknown=True) for said in ("Hilfe, ich falle!", "Ich rufe Hilfe")]
    ['surely', 'surely']
    >>> calls_for_help("Aiutami con le scarpe", unknown=True)
    'perhaps'
    >>> calls_for_help("Danke für deine Hilfe.", unknown=True)
    >>> calls_for_help("Help me, grandma!", unknown=False)
    """
    patterns, folded = _patterns(*folders()), _folded(said)
    pattern = patterns.called if unknown else patterns.foreign
    clauses = [one for one in map(str.strip, _CLAUSE.split(folded)) if one]
    alone = any(map(pattern.fullmatch, clauses)) or patterns.whole.fullmatch(folded)
    if patterns.thanks.search(folded):
        return "perhaps" if alone else None
    if alone or not unknown:
        return "surely" if alone else None
    if patterns.calls.search(folded):
        return "surely" if patterns.cried.search(folded) else "perhaps"
    return None


@lru_cache(4)  # a remark is read several times
def says_stop(said: str, *, moving: bool) -> bool:
    """Return whether a remark is an order to stop in a language without a folder.

    Only words such as "please", words of pain and calls for help may stand beside it. If the body
    is ``moving``, words of pain are such orders, too.

    >>> says_stop("Lass los! Bitte lass los!", moving=False), says_stop("Aua!", moving=True)
    (True, True)
    >>> says_stop("Das ist halt so.", moving=True)
    False
    """
    patterns = _patterns(*folders())
    return (patterns.moving if moving else patterns.stop).fullmatch(_folded(said)) is not None


def is_foreign_order(said: str) -> bool:
    """Return whether a remark is an order to stop, or a cry of pain, that English does not have.

    >>> is_foreign_order("Finger weg!"), is_foreign_order("Stop!")
    (True, False)
    """
    return _patterns(*folders()).order.fullmatch(_folded(said)) is not None


def says_yes(said: str) -> bool:
    """Return whether a remark is "yes" in a language without a folder.

    >>> says_yes("Ja, bitte!"), says_yes("Ja, das Wetter ist schön.")
    (True, False)
    """
    return _patterns(*folders()).yes.fullmatch(_folded(said)) is not None


def _folded(said: str) -> str:
    """Return text without capitals, accents and drawn-out letters."""
    bare = unicodedata.normalize("NFKD", said[:_LONGEST].casefold())[:_LONGEST]
    kept = "".join(sign for sign in bare if unicodedata.category(sign) != "Mn")
    return re.sub(r"(\w)\1{2,}", r"\1", kept.translate(_LETTERS).replace("’", "'"))


@cache
def _patterns(*known: Language) -> _Patterns:
    text = resources.files(__package__).joinpath("abroad.toml").read_text(encoding="utf-8")
    table = _Abroad.model_validate(tomllib.loads(text))
    words: dict[str, set[str]] = {
        name: {
            _folded(spelt)
            for language, listed in rows.items()
            if language not in known
            for word in listed
            for spelt in (word, word.translate(_UMLAUTS), word.replace("-", " "))
        }
        for name, rows in vars(table).items()
    }
    calls, stop, moving = words["cry"] | words["call"], words["stop"], words["moving"]
    foreign = {call for call in calls if not call.startswith("help")}
    beside, cry = words["beside"] | words["no"], _any(words["cry"])
    return _Patterns(
        calls=re.compile(_any(calls | words["whole"])),
        called=_only(calls, beside),
        foreign=_only(foreign, beside),
        whole=_only(foreign | words["whole"], beside),
        cried=re.compile(rf"^\W*{cry}|{cry}\W*$"),
        thanks=re.compile(_any(words["thanks"])),
        stop=_only(stop, beside | calls | moving),
        moving=_only(stop | moving, beside | calls),
        order=_only((stop | moving) - {"stop", "halt"}, beside | calls | stop),
        yes=_only(words["yes"], words["beside"]),
    )


def _only(words: Collection[str], beside: Collection[str]) -> re.Pattern[str]:
    """Return a pattern for text of these words, with others beside them."""
    # Possessive, or else a long text of ambiguous words would take exponentially long.
    return re.compile(rf"(?=.*?{_any(words)})(?:\W*{_any({*words, *beside})})++\W*", re.DOTALL)


def _any(words: Collection[str]) -> str:
    """Return a pattern for one of these words, which other words must not continue."""
    each = (
        re.escape(word) if _UNSPACED.search(word) else rf"(?<!\w){re.escape(word)}(?!\w)"
        for word in sorted(words, key=len, reverse=True)
    )
    return f"(?:{'|'.join(each)})"
