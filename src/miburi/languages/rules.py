"""A language's rules: how its text is recognised, and reduced to plain words."""

import re
import unicodedata
from collections.abc import Callable, Mapping
from functools import cache, cached_property
from typing import Annotated, Any, Self

from pydantic import Field

from miburi.ground.tables import Table
from miburi.languages.files import Language, read

#: The signs that people write as an apostrophe.
APOSTROPHES = "'’‘`´ʼ"
_NAME = re.compile(r"\{([a-z_]+)\}")
#: Parts of a pattern: escapes and beginnings of groups; sets of letters; letters that plain words
#: lack.
_SYNTAX, _SET = r"\\.|\(\?P[<=>]|\(\?[a-zA-Z]", r"\[\^?\]?(?:\\.|[^\]\\])*\]"
_PARTS = re.compile(rf"(?P<syntax>{_SYNTAX})|(?P<set>{_SET})|[A-Z]|[^\x00-\x7f]", re.DOTALL)
_UNESCAPED = re.compile(r"(?<!\\)[^\\]")


class _Whom(Table):
    """Patterns for pronouns such as "she", and for people they mean (groups ``own``, ``it``)."""

    says: str
    means: str


class Clue(Table):
    """Regular expressions for one kind of question, and for the statements that answer it.

    With ``names``, a name in a statement is an answer, too. A clue that is not ``enough`` counts
    only if question and statement also share a word. A statement without a ``needed`` clue, such as
    a time for "when", is no answer.
    """

    asks: str
    tells: str = "(?!)"
    names: bool = False
    enough: bool = True
    needed: bool = False


class Rules(Table):
    """One language's ``language.toml``."""

    script: str | None = None
    common: str = ""
    spaced: bool = True
    apostrophes: Annotated[str, Field(pattern="^(join|split)$")] = "join"
    accents: bool = True
    spellings: dict[str, str] = Field(default_factory=dict)
    denied: str = "(?!)"
    same: list[str] = Field(default_factory=list)
    subject: str = "(?!)"
    everything: str = "(?!)"
    own: str = ""
    naming: str = "(?!)"
    clues: list[Clue] = Field(default_factory=list)
    elsewhere: list[str] = Field(default_factory=list)
    whom: list[_Whom] = Field(default_factory=list)
    called: list[str] = Field(default_factory=list)
    parts: dict[str, str] = Field(default_factory=dict)

    @cached_property
    def words(self) -> frozenset[str]:
        """The most common words."""
        return frozenset(self.common.split())

    def spelt(self, text: str) -> str:
        """Return a text without accents where they do not count: "ü" as "u", "ß" as "ss"."""
        if self.accents:
            return text
        apart = unicodedata.normalize("NFD", text)
        apart = "".join(one for one in apart if unicodedata.category(one) != "Mn")
        return apart.replace("ß", "ss")

    def as_pattern(self, phrase: str) -> str:
        """Return a pattern of words as they are written as one of plain words.

        Where accents do not count, "ü" matches "u" and "ue".
        """
        if not self.spaced:
            return phrase
        between = "" if self.apostrophes == "join" else " "
        phrase = re.sub(rf"(?<=\w)[{APOSTROPHES}](?=\w)", between, phrase)
        return _PARTS.sub(self._as_part, unicodedata.normalize("NFC", phrase))

    def _as_part(self, part: re.Match[str]) -> str:
        if part["syntax"]:
            return part.group()
        if part["set"]:
            return _UNESCAPED.sub(lambda one: self.spelt(one.group().lower()), part.group())
        small = part.group().lower()
        bare = self.spelt(small)
        if bare == small:
            return bare
        return f"(?:{bare}e?)" if small in "äöü" else f"(?:{bare})"

    def as_plain(self) -> Self:
        """Return the rules with all patterns and words as those of plain words."""
        kept = {"script", "called", "apostrophes"}
        words = {
            "common": self.spelt(self.common.lower()),
            "same": [self.spelt(each.lower()) for each in self.same],
            "spellings": {self.spelt(each): instead for each, instead in self.spellings.items()},
        }
        patterns = self.model_dump(exclude=kept | words.keys())
        same = {name: getattr(self, name) for name in kept}
        return self.model_validate(same | _each(self.as_pattern, patterns) | words)

    @cached_property
    def first(self) -> dict[str, str]:
        """Each synonym, with the first word of its group."""
        groups = [group.split() for group in self.same]
        return {word: words[0] for words in groups for word in words}

    @cached_property
    def respelled(self) -> re.Pattern[str]:
        """A pattern of the words in ``spellings``."""
        either = "|".join(re.escape(each) for each in self.spellings)
        return re.compile(rf"(?<!\S)(?:{either})(?!\S)" if either else r"(?!)")

    @cached_property
    def told_clues(self) -> list[tuple[re.Pattern[str], bool]]:
        """For each clue, the pattern of statements that answer it, and whether a name does, too."""
        return [(re.compile(filled(each.tells, self.parts)), each.names) for each in self.clues]


def _each(function: Callable[[str], str], values: Any) -> Any:
    """Return values of a table with a function applied to each text, but not to keys."""
    match values:
        case str():
            return function(values)
        case list():
            return [_each(function, each) for each in values]
        case dict():
            return {key: _each(function, each) for key, each in values.items()}
    return values


@cache
def rules_of(language: Language) -> Rules:
    """Return a language's ``language.toml``, with its patterns as those of plain words."""
    return (read(Rules, language, "language") or Rules()).as_plain()


def filled(phrase: str, words: Mapping[str, str] | None) -> str:
    """Return a pattern with its {names} filled in."""
    while words and _NAME.search(phrase):
        phrase = _NAME.sub(lambda found: words[found.group(1)], phrase)
    return phrase.replace(" .. ", r"(?: \S+){0,4} ")
