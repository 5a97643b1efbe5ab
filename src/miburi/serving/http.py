"""How the server accepts connections, and limits them before it knows who is asking.

Headers are limited in size, and must arrive in time. If an address has too many connections, its
oldest silent one is closed, so nobody can shut others out by opening many connections and sending
nothing. An encrypted connection is counted from its first moment, not only after its handshake.

If a separate process, the :mod:`reception <miburi.serving.reception>`, accepts the connections,
each http request arrives through a :class:`Passage` on a separate connection, which is closed after
the answer.
"""

import asyncio
import logging
import socket
import ssl
from asyncio.sslproto import SSLProtocol
from collections import defaultdict
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import h11
import uvicorn
from starlette.types import ASGIApp, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from uvicorn.server import ServerState
from websockets.frames import Frame

from miburi.serving.access import CAME, CONNECTIONS, HEADER_TIME, HEADERS, LARGEST
from miburi.serving.passing import ENCRYPTED, Note, Passed, taken_in

#: How long, in s, to wait for the other side to close a connection that we have closed: it may be
#: asleep. This must be shorter than the time that the server's shutdown may take.
_FAREWELL = 0.5
_BACKLOG = 2048
#: If a WebSocket's client has not answered a ping after this time, in s, it has fallen behind, and
#: gets nothing more until it answers. This is also the shortest time between two pings (our
#: choice).
UNREAD = 0.5
#: Key in a request's state for the reception's note about the request's connection.
_NOTE = "note"
#: How many connections are accepted before waiting requests are served.
_AT_ONCE = 16


class _Connection(H11Protocol):
    """An HTTP connection."""

    _timer: asyncio.TimerHandle | None = None  # runs until headers arrive
    note: Note | None = None  # from a reception

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        if self.note is not None:
            self.client, self.server = self.note.client, self.note.server
        if self._timer is not None:
            return  # its handshake is over; it is counted already
        crowd = self._crowds[self._address]
        if len(crowd) >= CONNECTIONS:
            # The new connection is never closed, because it may carry a Stop.
            silent = (other for other in crowd if other._timer is not None)
            oldest = next(silent, next(iter(crowd)))
            oldest.transport.abort()
            oldest._leave()
        self._crowds[self._address][self] = None
        self._timer = self.loop.call_later(HEADER_TIME, transport.abort)

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        if self.scope is not None:  # its first headers have arrived
            self._hear()

    def on_response_complete(self) -> None:
        super().on_response_complete()
        if self.note is not None and self.note.kind != ENCRYPTED:
            self.transport.close()  # this tells the reception that the answer is complete

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        self._leave()
        super().handle_websocket_upgrade(event)

    def connection_lost(self, exc: Exception | None) -> None:
        self._leave()
        super().connection_lost(exc)

    @property
    def _address(self) -> str:
        return self.client[0] if self.client else ""

    @property
    def _crowds(self) -> "defaultdict[str, dict[_Connection, None]]":
        """The server's open connections by address, the oldest first."""
        return _CROWDS.setdefault(self.server_state, defaultdict(dict))

    def _hear(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _leave(self) -> None:
        self._hear()
        self._crowds[self._address].pop(self, None)
        if not self._crowds[self._address]:
            del self._crowds[self._address]


_CROWDS: WeakKeyDictionary[ServerState, defaultdict[str, dict[_Connection, None]]]
_CROWDS = WeakKeyDictionary()


class _Socket(WebSocketsSansIOProtocol):
    """One WebSocket; it waits until the client has read what was sent.

    The kernels on both sides and the reception may hold minutes of small messages, so TCP tells too
    late that a client has stopped reading. A client answers a ping once it has read all messages
    before the ping.
    """

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._answered = asyncio.Event()
        super().connection_made(transport)

    async def send(self, message: Any) -> None:
        speaks = message["type"] == "websocket.send"
        if speaks and self.pending_ping_payload is not None and self._pinged_long_ago:
            self._answered.clear()
            await self._answered.wait()
        await super().send(message)
        if speaks and self._pinged_long_ago:
            self.stop_keepalive()  # this ping takes the next one's place
            self.send_keepalive_ping()

    def handle_pong(self, event: Frame) -> None:
        super().handle_pong(event)
        if self.pending_ping_payload is None:
            self._answered.set()

    def connection_lost(self, exc: Exception | None) -> None:
        super().connection_lost(exc)
        self._answered.set()

    @property
    def _pinged_long_ago(self) -> bool:
        return self.loop.time() - self.ping_sent_at > UNREAD


class _Handshake(SSLProtocol):
    """Encrypts a connection, which counts as silent until its handshake is over.

    ``create_server(ssl=…)`` gives no access to a connection before its handshake is over, so
    connections that never complete one could not be limited.
    """

    max_size = 16_384  # size of each connection's buffer; asyncio's 256 KiB would help a flood

    def __init__(self, connection: _Connection, context: ssl.SSLContext) -> None:
        super().__init__(
            connection.loop,
            connection,
            context,
            None,  # type: ignore[arg-type]  # nobody waits for it
            server_side=True,
            ssl_shutdown_timeout=_FAREWELL,
        )
        self._counted = connection

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        self._counted.connection_made(transport)
        super().connection_made(transport)

    def connection_lost(self, exc: BaseException | None) -> None:
        super().connection_lost(exc)
        if self._counted.scheme != "https":  # otherwise super() has done this
            self._counted.connection_lost(None)


def configure(app: ASGIApp, *, lifespan: bool = True) -> uvicorn.Config:
    """Return the configuration of an application's server; all our servers use it.

    ``app`` is behind its :class:`~miburi.serving.access.Gate`; with ``lifespan``, the application
    is told of the server's start and end.
    """

    async def known(scope: Scope, receive: Receive, send: Send) -> None:
        note = scope.get("state", {}).pop(_NOTE, None)
        if note is not None:  # a WebSocket's protocol only knows the server's own peer
            scope = {**scope, "client": note.client, "server": note.server}
            if note.kind != ENCRYPTED:  # an encrypted connection carries many requests
                scope["state"] = {**scope["state"], CAME: note.came}
        await app(scope, receive, send)

    config = uvicorn.Config(
        known,
        http=_Connection,
        log_level="error",  # strangers' malformed requests are no news
        log_config=None,  # it logs as we do
        lifespan="on" if lifespan else "off",
        ws=_Socket,
        ws_max_size=LARGEST,
        ws_per_message_deflate=False,  # compressing a small state costs more than sending it
        timeout_graceful_shutdown=2,
        server_header=False,
        proxy_headers=False,  # the client is the peer, whatever a header says
        h11_max_incomplete_event_size=HEADERS,
        backlog=_BACKLOG,
    )
    logging.getLogger("uvicorn.error").addFilter(_tells_more_than_the_end)
    return config


def _tells_more_than_the_end(record: logging.LogRecord) -> bool:
    """Return False for requests that were cancelled because the server ended: that is no error."""
    error = record.exc_info[1] if record.exc_info else None
    cancels = str(record.msg).startswith("Cancel %s running task(s)")
    return not (cancels or isinstance(error, asyncio.CancelledError))


def _made(server: uvicorn.Server) -> _Connection:
    loop = asyncio.get_running_loop()
    return _Connection(server.config, server.server_state, server.lifespan.state, loop)


async def listen_encrypted(
    server: uvicorn.Server, listener: socket.socket, context: ssl.SSLContext
) -> None:
    """Let a running server also listen on a socket for https."""
    server.servers.append(
        await asyncio.get_running_loop().create_server(
            lambda: _Handshake(_made(server), context),
            sock=listener,
            backlog=server.config.backlog,
        )
    )


class Passage:
    """The server's end of the socket to a reception.

    ``end`` is a non-blocking Unix socket; ``server`` has started; ``context`` encrypts https.
    """

    def __init__(
        self, end: socket.socket, server: uvicorn.Server, context: ssl.SSLContext | None
    ) -> None:
        self._end, self._server, self._context = end, server, context
        self._loop = asyncio.get_running_loop()
        self._coming: set[asyncio.Task[object]] = set()
        self._loop.add_reader(end.fileno(), self._take_in)

    def close(self) -> None:
        """Stop accepting connections."""
        self._loop.remove_reader(self._end.fileno())

    def _take_in(self) -> None:
        for passed in taken_in(self._end, _AT_ONCE):
            if passed is None:
                self.close()
                return
            make = partial(
                self._make_encrypted if passed.note.kind == ENCRYPTED else self._make, passed
            )
            task = self._loop.create_task(self._welcome(make, passed.line))
            self._coming.add(task)
            task.add_done_callback(self._coming.discard)

    async def _welcome(self, make: Callable[[], asyncio.BaseProtocol], line: socket.socket) -> None:
        with suppress(OSError):  # it has gone
            await self._loop.connect_accepted_socket(make, line)

    def _make(self, passed: Passed) -> _Connection:
        connection = _made(self._server)
        connection.note = passed.note
        connection.app_state = {**connection.app_state, _NOTE: passed.note}
        return connection

    def _make_encrypted(self, passed: Passed) -> asyncio.BaseProtocol:
        if self._context is None:
            raise ValueError("a server without a certificate accepts no encrypted connections.")
        return _Handshake(self._make(passed), self._context)


def encryption(certificate: Path) -> ssl.SSLContext:
    """Return a server's TLS context, from the PEM file of its key and certificate."""
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    context.load_cert_chain(certificate)
    context.set_alpn_protocols(["http/1.1"])
    return context
