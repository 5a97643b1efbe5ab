"""Words as they stand in a text, found again from the plain words that a pattern matched."""

import re

from miburi.languages import Language, plain

__all__ = ["as_written"]


def as_written(words: str, said: str, language: Language = "en") -> str:
    """Return plain words as they stand in a text, with a name that follows them.

    >>> as_written("my sister", "Tell me when my sister Anna comes.")
    'my sister Anna'
    >>> as_written("my neighbour", "My neighbour Mr Hussain cuts my hedge.")
    'My neighbour Mr Hussain'
    >>> as_written("my wifes name", "My wife's name is Maureen.")
    "My wife's name"
    >>> as_written("the soup she is got a cold", "Take Marjorie the soup, she's got a cold.")
    "the soup, she's got a cold"
    """
    # A plain "wifes" may be written "wife's".
    spelled = ("['’]?".join(map(re.escape, word)) for word in words.split())
    either = r"[\W_]+".join(spelled)
    name = r"(?-i:(?:(?:Mrs?|Ms|Miss|Dr|Father|Sister)\.? )?(?!I\b)[A-Z]\w+)"
    found = re.search(rf"({either})( {name})?", said, re.IGNORECASE)
    if found:
        return re.sub(r"['’]s$", "", found.group())
    # A plain "she is" may be written "she's".
    parts = said.split()
    plainly = [(word, n) for n, part in enumerate(parts) for word in plain(part, language).split()]
    wanted = words.split()
    for start in range(len(plainly) - len(wanted) + 1):
        span = plainly[start : start + len(wanted)]
        if [word for word, _ in span] == wanted:
            return " ".join(parts[span[0][1] : span[-1][1] + 1]).strip(" .,;!?")
    return words
