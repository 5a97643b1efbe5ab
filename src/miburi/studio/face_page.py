"""The face (``/face``): full screen on a phone, one page without any library."""

import json
from pathlib import Path

from fastapi import FastAPI, Request
from fastapi.responses import HTMLResponse

from miburi.feelings.catalogue import CATALOGUE
from miburi.studio.words import preferred, words

_PAGE = Path(__file__).parent / "static" / "face.html"


def add_face_page(app: FastAPI) -> None:
    """Add the face at ``/face``."""
    page = _PAGE.read_text(encoding="utf-8")

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
        content = json.dumps(say, ensure_ascii=False).replace("<", "\\u003c")
        return HTMLResponse(page.replace("$LANGUAGE", language).replace("$WORDS", content))
