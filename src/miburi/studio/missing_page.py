"""What a visitor sees at an address where there is no page."""

from pathlib import Path

from fastapi import Request
from fastapi.responses import HTMLResponse

from miburi.ground.templates import render
from miburi.serving.policy import own_page
from miburi.studio.preferences import Preferences
from miburi.studio.words import words

__all__ = ["missing_page"]

_PAGE = Path(__file__).with_suffix(".html")


async def missing_page(request: Request, _error: Exception | None = None) -> HTMLResponse:
    """Answer with 404 and the ways back, in the visitor's language."""
    preferences = Preferences.of(request)
    say = words(preferences.language)
    back = {name: say["privacy"][name] for name in ("studio", "face")}
    page = render(
        _PAGE,
        language=preferences.language,
        scheme=preferences.scheme,
        words={**say["missing"], **back},
    )
    return own_page(page, 404)
