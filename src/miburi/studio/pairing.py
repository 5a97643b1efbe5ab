"""Pair a phone: it scans a QR code, a page sends the token, and a cookie keeps the phone's key."""

from collections.abc import Callable

from fastapi import APIRouter, Request, Response
from fastapi.responses import JSONResponse, RedirectResponse
from pydantic import Field

from miburi.serving.access import AUTHORITY, PAIRING
from miburi.serving.allowance import Allowance
from miburi.serving.heads import COOKIE
from miburi.serving.keys import LIFE
from miburi.serving.policy import own_page
from miburi.serving.reach import Reach
from miburi.wire.messages import Message

__all__ = ["PairIn", "pairing_router"]

#: Wrong tokens allowed per second, and in a burst, from all devices together (our choice).
_RATE, _BURST = 0.5, 20.0
_WRONG = "This is not this partner's token. Scan the code again."


class PairIn(Message):
    """The token, as shown in the terminal and the studio."""

    token: str = Field(max_length=200)


def pairing_router(reach: Reach, content: Callable[[Request], str]) -> APIRouter:
    """Return the routes of the pairing page, the only ones that answer without a token.

    Parameters
    ----------
    reach
        Holds the keys for pairing, and the certificate of the partner's own authority.
    content
        Returns the page for a request, as HTML.
    """
    router = APIRouter(include_in_schema=False)
    wrong = Allowance(_RATE, _BURST)
    keys = reach.keys

    @router.get(PAIRING)
    async def page(request: Request) -> Response:
        return RedirectResponse("/") if keys is None else own_page(content(request))

    @router.post(PAIRING)
    async def pair(wish: PairIn, request: Request) -> Response:
        if keys is None:
            return Response(status_code=204)
        if not keys.is_token(wish.token):
            if not wrong.take("everybody"):
                return JSONResponse({"detail": "Too many wrong tokens; wait a minute."}, 429)
            return JSONResponse({"detail": _WRONG}, 401)
        earlier = request.cookies.get(COOKIE, "")
        key = keys.pair(request.headers.get("user-agent", ""), earlier)
        if not keys.is_token(wish.token):  # all devices were forgotten in the meantime
            keys.drop(key)
            return JSONResponse({"detail": _WRONG}, 401)
        answer = Response(status_code=204)
        answer.set_cookie(
            COOKIE,
            key,
            max_age=LIFE,
            httponly=True,
            samesite="strict",
            secure=request.url.scheme == "https",
        )
        return answer

    if reach.authority is not None:

        @router.get(AUTHORITY)
        async def authority() -> Response:
            return Response(reach.authority, media_type="application/x-x509-ca-cert")

    return router
