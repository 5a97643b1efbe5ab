"""Text as tokens, each with the ids of its groups of words and letters.

Training and use share this module, so that both see the same groups.
"""

import re
import unicodedata
from itertools import pairwise
from zlib import crc32

_CONTRACTED = ((re.compile(r"\bcan'?t\b"), "can not"), (re.compile(r"\bwon'?t\b"), "will not"))
_NOT = re.compile(
    r"\b(do|does|did|is|are|was|were|have|has|had|would|could|should|must|need|ai)n'?t\b"
)
_LONG = re.compile(r"(\w)\1{2,}")
_TOKEN = re.compile(r"[^\W\d_]+(?:'[^\W\d_]+)?|\d+|[^\w\s]")
_SIGNS = re.compile(r"(?!')[^\w\s]")


def tokens(text: str) -> list[str]:
    """Return the words, numbers and signs of a text, in lower case.

    Apostrophes become straight, "n't" becomes "not", and drawn-out letters are written twice.

    >>> tokens("I don’t know, sooooo…")
    ['i', 'do', 'not', 'know', ',', 'soo', '.', '.', '.']
    """
    text = unicodedata.normalize("NFKC", text).lower().replace("’", "'").replace("‘", "'")
    for pattern, words in _CONTRACTED:
        text = pattern.sub(words, text)
    text = _NOT.sub(r"\1 not", text)
    return _TOKEN.findall(_LONG.sub(r"\1\1", text))


def without_punctuation(text: str) -> str:
    """Return a text as a speech recogniser would write it."""
    return _SIGNS.sub(" ", text.replace("’", "'").replace("‘", "'")).lower()


def numbers_of(words: list[str]) -> list[int]:
    """Return the ids of the words, followed by the ids of the pairs of neighbouring words."""
    pairs = [f"{first} {second}" for first, second in pairwise(words)]
    return [crc32(text.encode()) for text in words + pairs]


def letters(word: str) -> list[int]:
    """Return the ids of the groups of two to five letters in a word with its ends marked."""
    if not word[0].isalpha():
        return []
    bordered = f"^{word}$".encode()
    last = len(bordered) + 1
    return [
        crc32(bordered[start : start + size])
        for size in range(2, 6)
        for start in range(last - size)
    ]
