"""The face (``/face``): one page for a phone's whole screen, without any library."""

from collections.abc import Sequence
from pathlib import Path

from fastapi import FastAPI, Request
from fastapi.responses import HTMLResponse

from miburi.feelings.catalogue import CATALOGUE
from miburi.ground.templates import render
from miburi.studio.parts import senses_form, signs, talk_form
from miburi.studio.preferences import Preferences
from miburi.studio.words import words

__all__ = ["add_face_page"]

_PAGE = Path(__file__).with_suffix(".html")


def add_face_page(app: FastAPI, sounded: Sequence[str] = ()) -> None:
    """Add the face at ``/face``.

    Parameters
    ----------
    app
        The application.
    sounded
        The languages that the partner's computer turns into sound itself.
    """

    @app.get("/face", include_in_schema=False)
    async def face(request: Request) -> HTMLResponse:
        preferences = Preferences.of(request)
        say, shared = (
            words(preferences.language),
            ("stop", "stop_unreached", "stop_unsent", "release"),
        )
        content = {
            "feelings": say["feeling"],
            "faces": CATALOGUE.faces(),
            **say["face"],
            **{name: say["studio"][name] for name in shared},
            "stopped": say["phase"]["stopped"],
            "distress": say["talk"]["distress"],
            "distresses": say["distress"],
        }
        light = {True: "dark", False: "light", None: "light dark"}[preferences.dark]
        page = render(
            _PAGE,
            language=preferences.language,
            words=content,
            light=light,
            talk=talk_form(say),
            senses=senses_form(say, "voice", "speech", "motion", "ears", "eyes", sounded=sounded)
            + signs(say),
        )
        return HTMLResponse(page)
