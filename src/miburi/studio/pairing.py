"""Pair a phone: it scans a QR code, a page sends the token, and a cookie keeps the key."""

from fastapi import APIRouter, Request, Response
from fastapi.responses import JSONResponse, RedirectResponse
from pydantic import Field

from miburi.serving.access import AUTHORITY, PAIRING
from miburi.serving.allowance import Allowance
from miburi.serving.heads import COOKIE, asker
from miburi.serving.keys import LIFE
from miburi.serving.reach import Reach
from miburi.serving.strangers import Strangers
from miburi.studio.pages import page as page_of
from miburi.wire.messages import Message

#: Wrong tokens allowed per second, and in a burst, from all devices together (our choice).
_RATE, _BURST = 0.5, 20.0
_WRONG = "This is not this partner's token. Scan the code again."


class PairIn(Message):
    """The token, as shown in the terminal and the studio."""

    token: str = Field(max_length=200)


def pairing_router(reach: Reach) -> APIRouter:
    """Return the routes of the pairing page, which need no token."""
    router = APIRouter(include_in_schema=False)
    wrong = Allowance(_RATE, _BURST)
    keys, strangers = reach.keys, Strangers()

    @router.get(PAIRING)
    async def page(request: Request) -> Response:
        if keys is None:
            return RedirectResponse("/")
        return page_of(
            request,
            "pairing",
            encrypted=request.url.scheme == "https",
            onward=_onward(reach, request),
            fingerprint=reach.fingerprint,
        )

    @router.post(PAIRING)
    async def pair(wish: PairIn, request: Request) -> Response:
        if keys is None:
            return Response(status_code=204)
        if not keys.is_token(wish.token):
            strangers.note(asker(request.scope))
            if not wrong.take("everybody"):
                return JSONResponse({"detail": "Too many wrong tokens; wait a minute."}, 429)
            return JSONResponse({"detail": _WRONG}, 401)
        earlier = request.cookies.get(COOKIE, "")
        key = keys.pair(request.headers.get("user-agent", ""), earlier)
        if not keys.is_token(wish.token):  # devices were forgotten meanwhile
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


def _onward(reach: Reach, request: Request) -> str | None:
    """Return the https address for a visitor over http, if there is one."""
    if reach.authority is None or request.url.scheme == "https" or not reach.addresses:
        return None
    found = str((request.scope.get("server") or ("",))[0])
    same = [address for address in reach.addresses if f"//{found}:" in address]
    return (same or list(reach.addresses))[0]
