"""Pairing: a phone scans a QR code, the page hands in the token, and a cookie remembers it."""

from html import escape
from io import StringIO

import segno
from fastapi import APIRouter, Response
from fastapi.responses import HTMLResponse, JSONResponse, RedirectResponse
from pydantic import Field

from miburi.studio.access import COOKIE, PAIRING, Allowance, same
from miburi.studio.wire import Message

#: Wrong tokens a second and at once, from everybody together (ours).
_RATE, _BURST = 0.5, 20.0
_MONTH = 30 * 24 * 3600


class PairIn(Message):
    """The token, as shown in the terminal and the studio."""

    token: str = Field(max_length=200)


def pairing_url(address: str, token: str, page: str = "/") -> str:
    """Return the address that pairs a device and opens ``page``.

    The token stands behind the ``#``: browsers do not send that part, so no log can keep it.
    """
    return f"{address}{PAIRING}#{token}{page}"


def qr_for_terminal(text: str) -> str:
    """Return a QR code in characters."""
    out = StringIO()
    segno.make(text, error="m").terminal(out, compact=True)
    return out.getvalue()


def qr_svg(text: str) -> str:
    """Return a QR code as SVG, black on white."""
    return segno.make(text, error="m").svg_inline(scale=6, border=3, light="white")


def pairing_router(token: str | None) -> APIRouter:
    """Return the pairing page: the one route that answers without a token."""
    router = APIRouter(include_in_schema=False)
    wrong = Allowance(_RATE, _BURST)

    @router.get(PAIRING)
    async def page() -> Response:
        if token is None:
            return RedirectResponse("/")
        return HTMLResponse(_PAGE)

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


_SCRIPT = """
const form = document.querySelector('form'), words = document.querySelector('output');
async function pair(token, page) {
  words.textContent = '…';
  try {
    const answer = await fetch('/pair', {method: 'POST', body: JSON.stringify({token}),
                                         headers: {'Content-Type': 'application/json'}});
    if (answer.ok) location.replace(page);
    else words.textContent = (await answer.json()).detail;
  } catch { words.textContent = 'The partner does not answer.'; }
}
form.onsubmit = (event) => { event.preventDefault(); pair(form.token.value.trim(), '/'); };
const [, token, page] = /^#([\\w-]+)(\\/[\\w]*)?$/.exec(location.hash) ?? [];
if (token) { history.replaceState(null, '', '/pair'); pair(token, page ?? '/'); }
"""

_PAGE = f"""<!doctype html>
<html lang="en"><meta charset="utf-8"><title>{escape("Miburi: pair this device")}</title>
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>
  body {{ font: 18px/1.5 system-ui, sans-serif; background: #f6f0e7; color: #3c302a;
         display: grid; place-content: center; min-height: 100vh; margin: 0; padding: 0 24px; }}
  main {{ max-width: 26rem; }}
  h1 {{ font-weight: 600; margin: 0 0 .3em; }}
  input, button {{ font: inherit; padding: .6em .8em; border-radius: 12px; width: 100%;
                   box-sizing: border-box; border: 1px solid #b9a99d; margin-top: .6em; }}
  button {{ background: #b3432f; color: white; border: 0; font-weight: 600; }}
  output {{ display: block; min-height: 1.6em; margin-top: .8em; color: #a3331f; }}
</style>
<main>
  <h1>Miburi</h1>
  <p>To meet this partner, scan the code in its studio or its terminal, or type the token.</p>
  <form><label>Token <input name="token" autocomplete="off" autocapitalize="off" required></label>
  <button>Pair this device</button></form>
  <output role="status"></output>
</main>
<script>{_SCRIPT}</script></html>
"""
