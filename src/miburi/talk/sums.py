"""Work out a sum that somebody asks for: "What is seven times eight?"."""

import operator
import re
from collections.abc import Callable
from functools import cache

from miburi.languages import Language, is_spaced, plain
from miburi.talk.calendar import Sign
from miburi.talk.script import script

_Count = Callable[[float, float], float]
_COUNT: dict[Sign, _Count] = {
    "plus": operator.add,
    "minus": operator.sub,
    "times": operator.mul,
    "by": operator.truediv,
}
_SIGNS: dict[str, Sign] = {
    "+": "plus",
    "*": "times",
    "×": "times",
    "÷": "by",
    "/": "by",
    "−": "minus",
    " - ": "minus",
}
#: How many digits a number may have (our choice).
_MOST = 9


def sum_of(said: str, language: Language) -> str | None:
    """Return the result of an operation on two numbers; None without an operation or a result.

    >>> sum_of("What's seven times eight?", "en"), sum_of("Do you know what 391 / 17 is?", "en")
    ('56', '23')
    """
    rules, ways = script(language), _ways(language)
    for sign, name in _SIGNS.items():
        said = said.replace(sign, f" {rules.sums.get(name, name).split('|')[0]} ")
    words = plain(said, language)
    for name, way in ways.items():
        if (found := way.search(words)) is None:
            continue
        first, second = (rules.count(found.group(part)) for part in ("first", "second"))
        if name == "by" and second == 0:
            return None
        result = _COUNT[name](first, second)
        return f"{round(result, 2):,.10g}"
    return None


@cache
def _ways(language: Language) -> dict[Sign, re.Pattern[str]]:
    rules = script(language)
    word = "|".join([rf"\d{{1,{_MOST}}}", *map(re.escape, rules.numbers)])
    number = rf"(?:{word})(?: (?:{word}))*"
    gap, edge = (" ", r"\b") if is_spaced(language) else (" ?", "")
    return {
        name: re.compile(
            rf"{edge}(?P<first>{number}){gap}(?:{sign}){gap}(?P<second>{number}){edge}"
        )
        for name, sign in rules.sums.items()
    }
