"""The pairing page, for a device that has no token yet: it can load nothing else of ours."""

from pathlib import Path

from fastapi import Request

from miburi.ground.templates import render
from miburi.studio.preferences import Preferences
from miburi.studio.words import words

__all__ = ["pairing_page"]

_PAGE = Path(__file__).with_suffix(".html")


def pairing_page(request: Request) -> str:
    """Return the page in the visitor's language."""
    language = Preferences.of(request).language
    return render(_PAGE, language=language, words=words(language)["pairing"])
