"""The partner's own voice for its pages: its latest sentence, synthesized.

Each page whose voice is on plays the sound, and its mouth moves with it. During the sound, and 0.4
s after it, the page ignores sudden noises.
"""

import asyncio
from contextlib import suppress

from fastapi import APIRouter, HTTPException, Response

from miburi.errors import MiburiError
from miburi.feelings.catalogue import CATALOGUE
from miburi.live.settle import granted
from miburi.live.state import Spoken
from miburi.live.view import LivePartner
from miburi.live.wishes import KeepTime
from miburi.talk.synthesizer import LANGUAGES, Sound, Synthesizer
from miburi.wire.messages import Refusal


def voice_router(partner: LivePartner, synthesizer: Synthesizer) -> APIRouter:
    """Return the route of the latest sentence's sound.

    Sentences are synthesized one at a time, once for all pages.
    """
    router = APIRouter()
    turn = asyncio.Lock()
    latest: tuple[int, Sound | None] | None = None

    def spoken(number: int) -> Spoken:
        said = partner.snapshot.state.spoken
        sounds = said is not None and said.language in LANGUAGES and not said.tune
        if said is None or said.number != number or not sounds:
            raise HTTPException(
                404, "this is not the partner's latest sentence, or no sound can be made of it."
            )
        return said

    @router.get(
        "/api/v1/voice/{number}",
        response_class=Response,
        responses={
            200: {"content": {"audio/wav": {}}, "description": "A WAV file."},
            404: {"model": Refusal, "description": "There is no such sound."},
        },
    )
    async def voice(number: int) -> Response:
        """Return the sound of the latest spoken sentence, if ``number`` is its number."""
        nonlocal latest
        spoken(number)
        async with turn:
            said = spoken(number)  # there may be a newer sentence by now
            if latest is None or latest[0] != number:
                sound = await synthesizer.sound(said.text, CATALOGUE.voice(said.feeling))
                latest = number, sound
                if sound is not None:
                    with suppress(MiburiError):  # the sound plays even if the gestures for it fail
                        await granted(partner, KeepTime(number, sound.rhythm))
        if latest[1] is None:
            raise HTTPException(404, "this sentence has no sound.")
        return Response(latest[1].wave, media_type="audio/wav")

    return router
