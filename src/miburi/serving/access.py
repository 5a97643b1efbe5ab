"""Access control and rate limits for the server: one gate in front of every route.

On the loopback address anybody at this computer has access; on other addresses every path but the
pairing and privacy pages and the health check needs a token. Requests from other sites' pages are
refused unless the user allows their origin. If the server also serves https, it accepts no token
over plain http, and other devices get only these paths and the certificate authority there.
"""

import asyncio
import json
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from http import HTTPStatus
from weakref import WeakValueDictionary

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from miburi.serving.allowance import Allowance
from miburi.serving.files import for_connections, lasting_of
from miburi.serving.heads import (
    RefusedError,
    WrongTokenError,
    asker,
    check_host,
    check_site,
    has_headers,
    headers_of,
    int_or,
    is_own,
    tokens_of,
)
from miburi.serving.keys import Keys
from miburi.serving.origins import API, Headers, cors, permit
from miburi.serving.policy import NICEGUI, POLICY
from miburi.serving.strangers import Strangers

#: The only paths that need no token: the pairing page, the privacy page, the health check and, if
#: there is https, the certificate authority.
PAIRING, PRIVACY, HEALTH, AUTHORITY = "/pair", "/privacy", "/health", "/ca.pem"
#: The path of Stop, which no limit delays for authorised clients.
STOP = "/api/v1/stop"
#: The path of a stream of events, which stays open as a WebSocket does.
EVENTS = "/api/v1/events"
#: Key in a request's state for its time of arrival, in s, on the clock that all processes share.
#: Only the reception (the process that accepts connections) sets it.
CAME = "came"
#: The path for agents, if the partner lets them connect.
AGENTS = "/mcp"
#: From this revision of MCP on, headers name the method and the tool, and the server checks them
#: against the body. Older clients' calls all wait their turn.
_REVISION = {b"mcp-protocol-version": b"2026-07-28"}
#: An agent's call of its tool `stop`, which no limit delays either.
_AGENTS_STOP = _REVISION | {b"mcp-method": b"tools/call", b"mcp-name": b"stop"}
_AGENTS_LIST = _REVISION | {b"mcp-method": b"tools/list"}
#: The largest body of a request, and the largest message on a WebSocket, in bytes.
LARGEST = 65_536
#: The largest headers of a request, in bytes, and the time in s in which they must arrive (our
#: choice).
HEADERS, HEADER_TIME = 16_384, 10.0
#: The most open connections of an address, not counting sockets (our choice).
CONNECTIONS = 200
#: The limit on requests from one address: per second, and in a burst.
RATE, BURST = 50.0, 150.0
#: The limit on pages for one address, per second and in a burst; the server builds each page anew.
PAGE_RATE, PAGE_BURST = 1.0, 12.0
#: The same limit for all addresses together: building a page takes about 0.8 MB for a few seconds
#: (our choice).
_PAGES_RATE, _PAGES_BURST = 1.5, 15.0
#: The pause between two pages, in s, during which a waiting Stop is handled (our choice).
PAGE_BREATH = 0.05
#: For how long, in s, a client that receives its page slowly may delay other pages.
_PAGE_TIME = 1.0
#: The limit on wrong tokens from one address, per second and in a burst.
WRONG_RATE, WRONG_BURST = 0.2, 10.0
#: The most WebSockets and streams of events that may be open, if the limit of files allows it.
SOCKETS = 200
#: The most keys checked per request: cookies of one name can exist for several paths.
_LOOKED_AT = 4
#: The interval, in s, between two checks of an open socket's key (our choice).
_KEY_LOOK = 1.0
_FORGOTTEN = "this device was forgotten; pair it again."
_PAGES = ("/", "/face")
_METHODS = ("GET", "HEAD", "POST", "DELETE")
#: Security headers, sent with every response.
SAFE_HEADERS = (
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"x-frame-options", b"DENY"),
    (POLICY, NICEGUI),
)


class Gate:
    """An ASGI application in front of another, for access control and limits.

    Parameters
    ----------
    app
        The application behind the gate.
    keys
        The accepted keys; None on the loopback address. There, requests need no key, but their host
        must be a loopback name, as another site could make its own name point to this computer.
    clock
        Returns the time in s.
    https
        Whether the server also serves https.
    origins
        Other origins whose pages may use the interface.
    """

    def __init__(
        self,
        app: ASGIApp,
        keys: Keys | None = None,
        clock: Callable[[], float] = time.monotonic,
        *,
        https: bool = False,
        origins: frozenset[str] = frozenset(),
    ) -> None:
        self._app = app
        self._keys = keys
        self._https, self._origins = https, origins
        self._requests = Allowance(RATE, BURST, clock)
        self._agents = Allowance(RATE, BURST, clock)
        self._agents_turns: WeakValueDictionary[str, asyncio.Lock] = WeakValueDictionary()
        self._pages = Allowance(PAGE_RATE, PAGE_BURST, clock)
        self._all_pages = Allowance(_PAGES_RATE, _PAGES_BURST, clock)
        self._wrong = Allowance(WRONG_RATE, WRONG_BURST, clock)
        self._strangers = Strangers(clock)
        self._sockets = 0
        self._next_page = 0.0  # on the event loop's clock

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        origin = self.origin_of(scope["path"], given := headers_of(scope))
        if origin is not None:
            if scope.get("method") == "OPTIONS":
                await _tell(HTTPStatus.NO_CONTENT, permit(origin, given), send)
                return
            send = _with(cors(origin), send)
        try:
            key = self.check(scope)
        except RefusedError as refused:
            if isinstance(refused, WrongTokenError):
                self._strangers.note(asker(scope))
            if refused.status in (401, 426) and _wants_page(scope):
                where = f"{PAIRING}#{scope['path']}".encode()
                headers = [(b"location", where), (b"content-length", b"0")]
                await _tell(HTTPStatus.SEE_OTHER, headers, send)
                return
            await _refuse(scope, receive, send, refused)
            return
        if not _lasts(scope):
            if scope["path"] == AGENTS and not has_headers(scope, _AGENTS_STOP):
                await self._agents_turn(asker(scope), calls=not has_headers(scope, _AGENTS_LIST))
            serve = self._serve_page if scope["path"] in _PAGES else self._serve
            await serve(scope, receive, send)
            return
        self._sockets += 1
        try:
            await self._serve_socket(scope, receive, send, key)
        finally:
            self._sockets -= 1

    async def _serve_socket(
        self, scope: Scope, receive: Receive, send: Send, key: str | None
    ) -> None:
        """Serve a socket or a stream as long as its key is valid."""
        serve = self._app if scope["type"] == "websocket" else self._serve
        if key is None or self._keys is None:
            await serve(scope, receive, send)
            return
        over = False

        async def unless_over(message: Message) -> None:
            if not over:
                await send(message)

        serving = asyncio.ensure_future(serve(scope, receive, unless_over))
        try:
            while not (await asyncio.wait({serving}, timeout=_KEY_LOOK))[0]:
                if not self._keys.fits(key):
                    over = True
                    break
            else:
                await serving
        finally:
            serving.cancel()
            await asyncio.wait({serving})
        if over and scope["type"] == "websocket":
            with suppress(OSError, RuntimeError, TimeoutError):  # the client is gone or stuck
                async with asyncio.timeout(_KEY_LOOK):
                    await send({"type": "websocket.close", "code": 1008, "reason": _FORGOTTEN})

    async def _agents_turn(self, who: str, *, calls: bool) -> None:
        """Queue agents' calls, separately for each address.

        To an agent, a refusal would look like a broken tool. Lists of tools have a separate queue,
        because a client requests one before its first Stop.
        """
        lane = f"{who} {calls}"
        async with self._agents_turns.setdefault(lane, asyncio.Lock()):
            while not self._agents.take(lane):
                await asyncio.sleep(1 / RATE)

    async def _serve_page(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Build one page at a time, and pause briefly after each: a Stop may be waiting."""
        loop = asyncio.get_running_loop()
        while (left := self._next_page - loop.time()) > 0:
            await asyncio.sleep(min(left, PAGE_BREATH))
        self._next_page = loop.time() + _PAGE_TIME
        try:
            await self._serve(scope, receive, send)
        finally:
            self._next_page = loop.time() + PAGE_BREATH

    def origin_of(self, path: str, headers: Mapping[bytes, str]) -> str | None:
        """Return the origin of another site's page that may use this path, if any."""
        origin = headers.get(b"origin")
        return origin if origin in self._origins and path.startswith(API) else None

    def check(self, scope: Scope) -> str | None:
        """Let a request pass, and return the key that it needed.

        Raises RefusedError if the request may not pass.
        """
        headers = headers_of(scope)
        who = asker(scope)
        path = scope["path"]
        method = scope.get("method", "GET")
        encrypted = scope.get("scheme") in ("https", "wss")
        plain = self._https and not encrypted
        keys = None if plain and is_own(scope) else self._keys
        check_host(headers, near=keys is None)
        if self.origin_of(path, headers) is None:
            check_site(headers, encrypted=encrypted)
        unlocked = path in (PAIRING, PRIVACY, HEALTH) or (self._https and path == AUTHORITY)
        if keys is not None and plain and not (unlocked and method in ("GET", "HEAD")):
            raise RefusedError(
                426, "no token is accepted over plain http; use this partner's https address."
            )
        if self.origin_of(path, headers) is not None:  # allowed origins send a token, and no cookie
            headers.pop(b"cookie", None)
        key = None if keys is None or unlocked else self._check_key(headers, who, keys)
        if path == STOP and method == "POST":
            return key
        if method not in _METHODS:
            raise RefusedError(405, f"{method[:20]} is not allowed at this address.")
        limited = path.startswith("/api") or path in (PAIRING, PRIVACY, HEALTH, AUTHORITY)
        if limited and not self._requests.take(who):
            raise RefusedError(429, f"too many requests; at most {RATE:g} a second, please.")
        if path in _PAGES and not self._pages.take(who):
            raise RefusedError(429, "too many pages at once; wait a moment.")
        if path in _PAGES and not self._all_pages.take("everybody"):
            raise RefusedError(503, "others are opening too many pages; wait a moment.")
        most = min(SOCKETS, lasting_of(for_connections()))
        if _lasts(scope) and self._sockets >= most:
            raise RefusedError(503, f"{most} connections are open already; close one.")
        if int_or(headers.get(b"content-length"), 0) > LARGEST:
            raise RefusedError(413, f"a request may have {LARGEST} bytes at most.")
        return key

    def _check_key(self, headers: dict[bytes, str], who: str, keys: Keys) -> str:
        given = list(dict.fromkeys(tokens_of(headers)))
        for one in given[:_LOOKED_AT]:  # each check reads the disk
            if keys.fits(one):
                return one
        if given and not self._wrong.take(who):
            raise WrongTokenError(429, "too many wrong tokens; wait a minute.")
        wrong = "this token is wrong, or was withdrawn" if given else "a token is needed here"
        refusal = WrongTokenError if given else RefusedError
        raise refusal(
            401,
            f"{wrong}. Scan the QR code in the studio or in the terminal, open "
            f"{PAIRING}, or send the header Authorization: Bearer TOKEN.",
        )

    async def _serve(self, scope: Scope, receive: Receive, send: Send) -> None:
        received = 0
        began = False

        async def counted() -> Message:
            nonlocal received
            message = await receive()
            received += len(message.get("body", b""))
            if received > LARGEST:
                raise RefusedError(413, f"a request may have {LARGEST} bytes at most.")
            return message

        async def guarded(message: Message) -> None:
            nonlocal began
            if received > LARGEST and not began:
                # The application may have caught the refusal, and be reporting a parse error.
                raise RefusedError(413, f"a request may have {LARGEST} bytes at most.")
            if message["type"] == "http.response.start":
                began = True
                own = dict(message["headers"])  # our own pages set a stricter policy
                more = [header for header in SAFE_HEADERS if header[0] not in own]
                more += _farewell(scope)
                message = {**message, "headers": [*message["headers"], *more]}
            await send(message)

        try:
            await self._app(scope, counted, guarded)
        except RefusedError as refused:
            if not began:
                await _refuse(scope, receive, send, refused)


def _lasts(scope: Scope) -> bool:
    """Whether a connection stays open: a WebSocket, or a stream of events."""
    return bool(scope["type"] == "websocket" or scope["path"] == EVENTS)


def _wants_page(scope: Scope) -> bool:
    """Whether a person is opening a page, to whom an error in JSON would be of no use."""
    accepted = b"".join(value for name, value in scope["headers"] if name == b"accept")
    return scope.get("method") == "GET" and scope["path"] in _PAGES and b"text/html" in accepted


async def _tell(status: int, headers: Headers, send: Send, body: bytes = b"") -> None:
    start = {"type": "http.response.start", "status": status, "headers": [*headers, *SAFE_HEADERS]}
    await send(start)
    await send({"type": "http.response.body", "body": body})


def _with(headers: Headers, send: Send) -> Send:
    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            message = {**message, "headers": [*message["headers"], *headers]}
        await send(message)

    return sending


def _farewell(scope: Scope) -> list[tuple[bytes, bytes]]:
    """Return the header that closes the connection after a stream of events; none otherwise."""
    return [(b"connection", b"close")] if scope["path"] == EVENTS else []


async def _refuse(scope: Scope, receive: Receive, send: Send, refused: RefusedError) -> None:
    body = json.dumps({"detail": str(refused)}).encode()
    headers = [
        (b"content-type", b"application/json"),
        (b"content-length", str(len(body)).encode()),
        *_farewell(scope),
    ]
    if refused.status == HTTPStatus.UNAUTHORIZED:
        headers.append((b"www-authenticate", b'Bearer realm="miburi"'))
    if scope["type"] == "websocket":
        await receive()  # the client's request to connect
        send = _instead_of_accepting(send)
    await _tell(refused.status, headers, send, body)


def _instead_of_accepting(send: Send) -> Send:
    """Return a ``send`` that answers a WebSocket by HTTP instead of accepting it."""

    async def sending(message: Message) -> None:
        await send({**message, "type": f"websocket.{message['type']}"})

    return sending
