"""Pair a phone: it scans a QR code, the page sends the token, and a cookie keeps it."""

from collections.abc import Callable
from io import StringIO

import segno
from fastapi import APIRouter, Request, Response
from fastapi.responses import HTMLResponse, JSONResponse, RedirectResponse
from pydantic import Field

from miburi.interface.access import COOKIE, PAIRING, Allowance, same
from miburi.interface.wire import Message

__all__ = ["PairIn", "pairing_router", "pairing_url", "qr_for_terminal", "qr_svg"]

#: Wrong tokens allowed per second, and in a burst, from all devices together (ours).
_RATE, _BURST = 0.5, 20.0
_MONTH = 30 * 24 * 3600


class PairIn(Message):
    """The token, as shown in the terminal and the studio."""

    token: str = Field(max_length=200)


def pairing_url(address: str, token: str, page: str = "/") -> str:
    """Return the address that pairs a device and opens ``page``.

    The token comes after the ``#``. Browsers do not send that part, so no log can keep it.
    """
    return f"{address}{PAIRING}#{token}{page}"


def qr_for_terminal(text: str) -> str:
    """Return a QR code as text for a terminal."""
    out = StringIO()
    segno.make(text, error="m").terminal(out, compact=True)
    return out.getvalue()


def qr_svg(text: str) -> str:
    """Return a QR code as SVG, black on white."""
    return segno.make(text, error="m").svg_inline(scale=6, border=3, light="white")


def pairing_router(token: str | None, content: Callable[[Request], str]) -> APIRouter:
    """Return the routes of the pairing page, the only ones that answer without a token.

    Parameters
    ----------
    token
        What pairs; None where nobody needs it.
    content
        Returns the page for a request, as HTML.
    """
    router = APIRouter(include_in_schema=False)
    wrong = Allowance(_RATE, _BURST)

    @router.get(PAIRING)
    async def page(request: Request) -> Response:
        return RedirectResponse("/") if token is None else HTMLResponse(content(request))

    @router.post(PAIRING)
    async def pair(wish: PairIn) -> Response:
        if token is None:
            return Response(status_code=204)
        if not same(wish.token, token):
            if not wrong.take("everybody"):
                return JSONResponse({"detail": "Too many wrong tokens; wait a minute."}, 429)
            words = "This is not the token of this partner. Scan the code again."
            return JSONResponse({"detail": words}, 401)
        answer = Response(status_code=204)
        answer.set_cookie(COOKIE, token, max_age=_MONTH, httponly=True, samesite="strict")
        return answer

    return router
