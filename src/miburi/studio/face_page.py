"""The face (``/face``): full screen on a phone, one page without any library."""

from pathlib import Path

from fastapi import FastAPI, Request
from fastapi.responses import HTMLResponse

from miburi.feelings.catalogue import CATALOGUE
from miburi.ground.templates import render
from miburi.studio.words import preferred, words

__all__ = ["add_face_page"]

_PAGE = Path(__file__).with_suffix(".html")


def add_face_page(app: FastAPI) -> None:
    """Add the face at ``/face``."""

    @app.get("/face", include_in_schema=False)
    async def face(request: Request) -> HTMLResponse:
        language = preferred(
            request.query_params.get("lang"),
            request.cookies.get("miburi_language"),
            request.headers.get("accept-language"),
        )
        say = {
            "feelings": words(language)["feeling"],
            "faces": CATALOGUE.faces(),
            **words(language)["face"],
            "stop": words(language)["studio"]["stop"],
            "release": words(language)["studio"]["release"],
            "stopped": words(language)["phase"]["stopped"],
        }
        return HTMLResponse(render(_PAGE, language=language, words=say))
