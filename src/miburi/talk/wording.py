"""Somebody's words as they were written, and as the partner says them: "my son", "your son"."""

import re
from collections.abc import Mapping

from miburi.languages import Language, is_spaced, plain

_PART = re.compile(r"\S+")
_NAME = re.compile(r"(?<=\w) (?:(?:Mrs?|Ms|Miss|Dr|Father|Sister)\.? )?(?!I\b)[A-Z]\w+")


def as_written(words: str, said: str, language: Language = "en") -> str:
    """Return the original wording of normalised words, with a name that follows them.

    >>> as_written("my sister", "Tell me when my sister Anna comes.")
    'my sister Anna'
    >>> as_written("my neighbour", "My neighbour Mr Hussain cuts my hedge.")
    'My neighbour Mr Hussain'
    >>> as_written("my wifes name", "My wife's name is Maureen.")
    "My wife's name"
    >>> as_written("my daughter", "My daughter-in-law Priya is good.")
    'My daughter-in-law Priya'
    >>> as_written("the soup she is got a cold", "Take Marjorie the soup, she's got a cold.")
    "the soup, she's got a cold"
    """
    if not is_spaced(language):
        place = said.casefold().find(words.casefold())
        return words if place < 0 else said[place : place + len(words)]
    # A normalised "she is" may be "she's" in the text, and "wifes" may be "wife's".
    plainly = [
        (word, part) for part in _PART.finditer(said) for word in plain(part[0], language).split()
    ]
    wanted = words.split()
    for start in range(len(plainly) - len(wanted) + 1):
        span = plainly[start : start + len(wanted)]
        if [word for word, _ in span] == wanted:
            end = span[-1][1].end()
            name = _NAME.match(said, end)
            found = said[span[0][1].start() : name.end() if name else end]
            return re.sub(r"['’]s$", "", found.strip(" .,;!?"))
    return words


class Turner:
    """Turns somebody's words into those of the partner.

    Parameters
    ----------
    turned
        Regular expressions of words that change with the speaker, and their replacements: ``my``
        becomes ``your``. The first match is used.
    echoed
        Regular expression of a question that the partner can repeat; its group is the part to
        repeat. An empty expression matches nothing.
    echo
        The form of the repeated question, with the slot ``it``.
    language
        In a language without spaces, a pattern must itself mark where words begin and end.
    """

    def __init__(
        self, turned: Mapping[str, str], echoed: str, echo: str, language: Language
    ) -> None:
        edge = r"(?<!\w)(?:{})(?!\w)" if is_spaced(language) else "(?:{})"
        written = [(edge.format(pattern), to) for pattern, to in turned.items()]
        self._each = [(re.compile(pattern, re.IGNORECASE), to) for pattern, to in written]
        self._any = re.compile("|".join(pattern for pattern, _ in written), re.IGNORECASE)
        self._echo = echo
        self._echoed = re.compile(echoed or "(?!)", re.IGNORECASE)

    def turn_round(self, words: str) -> str:
        """Return somebody's words from the partner's point of view: "my son" becomes "your son"."""
        return self._any.sub(self._turn, words)

    def _turn(self, found: re.Match[str]) -> str:
        # Patterns may look at the text around the words.
        for pattern, to in self._each:
            if one := pattern.match(found.string, found.start()):
                return one.expand(to)
        return found.group()

    def echo(self, said: str) -> str | None:
        """Return a remark's last question in the form in which the partner repeats it, or None."""
        asked = [found.group(1) for found in self._echoed.finditer(said)]
        if not asked:
            return None
        words = self.turn_round(asked[-1])
        return self._echo.format(it=f"{words[:1].upper()}{words[1:]}")
