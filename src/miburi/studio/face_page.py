"""The face (``/face``): a page that fills a phone's screen and uses no library."""

from collections.abc import Sequence
from typing import Annotated

from fastapi import FastAPI, Header, Request
from fastapi.responses import HTMLResponse

from miburi.errors import BodyError
from miburi.feelings.catalogue import CATALOGUE
from miburi.live.settle import granted
from miburi.live.view import LivePartner
from miburi.live.wishes import Release
from miburi.studio.forms import banner, reason, senses_form, signs, talk_form
from miburi.studio.pages import page
from miburi.studio.preferences import Preferences
from miburi.studio.words import words
from miburi.talk.care import Care
from miburi.wire.messages import Message

#: The path by which the page releases the body; programs use ``/api/v1/release``.
RELEASE = "/api/page/release"
_CARE = Care()


class _Shown(Message):
    """The serial number of the state that a page shows."""

    seen: int | None = None


def add_face_page(
    app: FastAPI, runner: LivePartner, sounded: Sequence[str] = (), care: Care = _CARE
) -> None:
    """Add the face at ``/face``.

    ``sounded`` are the languages of the partner's own voice; ``care`` knows the region's numbers.
    """

    @app.get("/face", include_in_schema=False)
    async def face(request: Request) -> HTMLResponse:
        language = Preferences.of(request).language
        say = words(language)
        shared = ("stop", "stop_unreached", "stop_unsent", "release")
        content = {
            "feelings": say["feeling"],
            "faces": CATALOGUE.faces(),
            **say["face"],
            **{name: say["studio"][name] for name in shared},
            "phase": say["phase"],
        }
        senses = senses_form(say, "voice", "speech", "motion", "ears", "eyes", sounded=sounded)
        return page(
            request,
            "face",
            words=content,
            talk=talk_form(say),
            senses=senses + signs(say),
            why=reason(say),
            banner=banner(say, care, language),
        )

    @app.post(RELEASE, status_code=204, include_in_schema=False)
    async def release(shown: _Shown, origin: Annotated[str | None, Header()] = None) -> None:
        # The gate has checked a browser's origin. A program that sends an ``Origin`` header poses
        # as a page on purpose.
        if origin is None:
            raise BodyError("only a person on one of the partner's own pages can release it here.")
        await granted(runner, Release(by_person=True, seen=shown.seen))
