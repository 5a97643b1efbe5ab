"""Find the original wording of the normalised words that a pattern matched."""

import re

from miburi.languages import Language, is_spaced, plain

__all__ = ["as_written"]

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
