"""The languages that the partner hears and speaks, told apart by their letters."""

import re
from typing import Literal, get_args

__all__ = ["LANGUAGES", "Language", "language_of"]

Language = Literal["en", "ja"]
LANGUAGES: tuple[Language, ...] = get_args(Language)
_JAPANESE = re.compile(r"[\u3040-\u30ff\u4e00-\u9fff]")


def language_of(text: str) -> Language:
    """Return the language of a text: Japanese where it holds kana or kanji, else English."""
    return "ja" if _JAPANESE.search(text) else "en"
