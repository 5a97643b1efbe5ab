"""A few words of languages that have no folder: calls for help, and orders to stop.

In fear or pain, people may use another language than the one that was chosen for the partner.
"""

import re
import tomllib
import unicodedata
from functools import cache
from importlib import resources

from miburi.ground.tables import Table
from miburi.languages.files import Language, folders

#: A call for help that English has, too: it counts only in a remark of unknown words.
_ALSO_ENGLISH = frozenset({"help", "help me"})


class _Abroad(Table):
    """The words, by the code of their language; see ``abroad.toml``."""

    help: dict[str, list[str]]
    stop: dict[str, list[str]]
    hurt: dict[str, list[str]]


def calls_for_help(said: str, *, unknown: bool) -> bool | None:
    """Return whether a remark begins with a foreign call for help; None: it has none.

    In a remark of ``unknown`` words, "help" is foreign, too.

    >>> calls_for_help("Hilfe, ich bin gestürzt!", unknown=True)
    True
    >>> calls_for_help("Danke für deine Hilfe.", unknown=True)
    False
    >>> calls_for_help("Help yourself to a biscuit.", unknown=False)
    """
    found = _patterns(*folders())[0 if unknown else 1].search(_folded(said))
    return None if found is None else not any(map(str.isalnum, found.string[: found.start()]))


def says_stop(said: str, *, moving: bool) -> bool:
    """Return whether a remark is a foreign order to stop and nothing else.

    A foreign "that hurts" is one, too, if the body is ``moving``.

    >>> says_stop("Lass los! Lass los!", moving=False), says_stop("Aua!", moving=True)
    (True, True)
    >>> says_stop("Das ist halt so.", moving=True)
    False
    """
    return _patterns(*folders())[3 if moving else 2].fullmatch(_folded(said)) is not None


def _folded(said: str) -> str:
    return unicodedata.normalize("NFC", said).casefold()


@cache
def _patterns(*known: Language) -> tuple[re.Pattern[str], ...]:
    """Return patterns for all calls, foreign ones, orders to stop, and these with words of pain.

    Languages with a folder have patterns of their own there.
    """
    text = resources.files(__package__).joinpath("abroad.toml").read_text(encoding="utf-8")
    table = _Abroad.model_validate(tomllib.loads(text))
    calls, stops, hurts = (
        {
            _folded(word)
            for language, words in each.items()
            if language not in known
            for word in words
        }
        for each in (table.help, table.stop, table.hurt)
    )
    within = (rf"(?<!\w){_either(each)}(?!\w)" for each in (calls, calls - _ALSO_ENGLISH))
    whole = (rf"\W*({_either(each)}(\W+|$))+" for each in (stops, stops | hurts))
    return tuple(map(re.compile, (*within, *whole)))


def _either(words: set[str]) -> str:
    return f"({'|'.join(map(re.escape, sorted(words, key=len, reverse=True)))})"
