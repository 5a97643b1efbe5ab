"""The page of people (``/people``): the people the partner knows, and when it may speak first.

Here a person allows the partner to remember people, and can see, correct, download and delete
everything that it knows.
"""

from pathlib import Path

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse

from miburi.ground.templates import render
from miburi.serving.policy import own_page
from miburi.studio.preferences import Preferences
from miburi.studio.words import words

__all__ = ["people_router"]

_PAGE = Path(__file__).with_suffix(".html")


def people_router() -> APIRouter:
    """Return the route of the page; its script asks the interface for what is known."""
    router = APIRouter(include_in_schema=False)

    @router.get("/people")
    async def people(request: Request) -> HTMLResponse:
        preferences = Preferences.of(request)
        all_words = words(preferences.language)
        return own_page(
            render(
                _PAGE,
                language=preferences.language,
                words=all_words["people"],
                back=all_words["privacy"],
                feelings=all_words["feeling"],
                scheme=preferences.scheme,
            )
        )

    return router
