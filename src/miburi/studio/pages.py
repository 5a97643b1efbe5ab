"""Pages from a template and words, in the visitor's language and colour scheme."""

from pathlib import Path

from fastapi import Request
from fastapi.responses import HTMLResponse

from miburi.ground.templates import render
from miburi.serving.policy import own_page
from miburi.studio.preferences import Preferences
from miburi.studio.words import words

_FOLDER = Path(__file__).parent


def page(request: Request, name: str, status: int = 200, **values: object) -> HTMLResponse:
    """Return the page that the template ``{name}_page.html`` makes of ``values``.

    The template also gets all words by section as ``say``, its own section as ``words``, and the
    visitor's ``language`` and colour ``scheme``; ``values`` may replace them.
    """
    preferences = Preferences.of(request)
    say = words(preferences.language)
    given = {"words": say[name], "language": preferences.language, "scheme": preferences.scheme}
    return own_page(
        render(_FOLDER / f"{name}_page.html", **{"say": say, **given, **values}), status
    )


async def missing_page(request: Request, _error: Exception | None = None) -> HTMLResponse:
    """Return the page for an unknown address, with status 404."""
    return page(request, "missing", 404)


async def people_page(request: Request) -> HTMLResponse:
    """Return ``/people``: permissions to remember people and to speak first, and all facts.

    The page's script loads the facts from the interface.
    """
    return page(request, "people")
