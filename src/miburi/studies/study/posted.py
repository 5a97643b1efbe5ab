"""Read the forms and codes of participants, and check each request before a page handles it."""

import secrets
import unicodedata
from collections.abc import Awaitable, Callable, Mapping
from urllib.parse import parse_qs, urlsplit

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from miburi.serving.heads import is_loopback
from miburi.studies.study.plan import SKIPPED, Question, Study

Form = Mapping[str, str]

#: The longest stored word, in characters, and the largest form, in bytes (our choice).
LONGEST, _LARGEST = 80, 16_384
#: Letters and digits that nobody confuses on paper.
_LETTERS = "23456789ABCDEFGHJKMNPQRSTUVWXYZ"

_HEADERS = (
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"same-origin"),
    (
        b"content-security-policy",
        b"default-src 'none'; style-src 'self'; img-src 'self'; media-src 'self'; "
        b"script-src 'self'; "
        b"form-action 'self'; base-uri 'none'; frame-ancestors 'none'",
    ),
)


def values_of(study: Study, question: Question, form: Mapping[str, str]) -> dict[str, str] | None:
    """Return the values of an answer by item; None if it is incomplete or not allowed."""
    if question.kind == "rating":
        allowed = [str(point) for point in range(1, question.points + 1)]
        values = {item.name: form.get(item.name, "") for item in question.items}
        return values if all(value in allowed for value in values.values()) else None
    value = form.get("answer", "").strip()
    if question.optional and not value:
        return {"": SKIPPED}
    if question.kind in ("choice", "check"):
        return {"": value} if value in study.options(question) else None
    if question.kind == "pick":
        return {"": value} if value in [option.name for option in question.answers] else None
    if question.kind == "number":
        whole = value.isascii() and value.isdigit() and len(value) <= 6
        allowed_here = whole and question.low <= int(value) <= question.high
        return {"": str(int(value))} if allowed_here else None
    # Words that look the same are stored identically, without invisible characters.
    plain = unicodedata.normalize("NFKC", value)
    shown = "".join(letter for letter in plain if letter.isprintable()).strip()
    return {"": shown} if 0 < len(shown) <= LONGEST else None


def make_code() -> str:
    """Return a random code of eight letters and digits, as in ``K7QM-2XHD``."""
    letters = "".join(secrets.choice(_LETTERS) for _ in range(8))
    return f"{letters[:4]}-{letters[4:]}"


def read_code(typed: str) -> str:
    """Return a participant's code as it was given out.

    Spaces and dashes of any kind make no difference, nor do small letters or full-width characters.
    """
    plain = unicodedata.normalize("NFKC", typed).upper()
    letters = "".join(letter for letter in plain if letter.isascii() and letter.isalnum())
    return f"{letters[:4]}-{letters[4:]}"


def posted(
    handle: Callable[[Request, Form], Response],
) -> Callable[[Request], Awaitable[Response]]:
    """Return an endpoint that reads a form, and handles it in a thread."""

    async def endpoint(request: Request) -> Response:
        body = b""
        async for part in request.stream():
            body += part
            if len(body) > _LARGEST:
                return Response(status_code=413)
        try:
            fields = parse_qs(body.decode("utf-8", "replace"), max_num_fields=50)
        except ValueError:  # more than 50
            return Response(status_code=413)
        form = {name: values[0] for name, values in fields.items()}
        return await run_in_threadpool(handle, request, form)

    return endpoint


class Door:
    """Refuses requests that are not allowed; adds the security headers to every response."""

    def __init__(self, app: ASGIApp, local: bool) -> None:
        self._app, self._local = app, local

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                message = {**message, "headers": [*message["headers"], *_HEADERS]}
            await send(message)

        if (status := self._refusal(Request(scope))) is not None:
            await Response(status_code=status)(scope, receive, guarded)
            return
        await self._app(scope, receive, guarded)

    def _refusal(self, request: Request) -> int | None:
        host = request.headers.get("host", "")
        try:
            name = urlsplit(f"//{host}").hostname or ""
            origin = urlsplit(request.headers.get("origin", f"//{host}")).netloc
        except ValueError:
            return 400
        if self._local and not is_loopback(name):
            return 403
        if request.method == "POST" and origin != host:  # another site's page sends it
            return 403
        return None
