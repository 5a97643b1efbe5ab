"""How the server listens: what it grants a connection before anybody knows who asks.

Headers are limited in size, and must come within a time. An address has so many connections:
when one more comes, its oldest silent one gives way, so that who opens many and says nothing
keeps nobody out. An encrypted connection counts from its first moment, not from its handshake's
end, so the same holds for it.
"""

import asyncio
import socket
import ssl
from asyncio.sslproto import SSLProtocol
from collections import defaultdict
from pathlib import Path
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import uvicorn
from starlette.types import ASGIApp
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.server import ServerState

from miburi.interface.access import LARGEST

if TYPE_CHECKING:
    import h11

__all__ = ["CONNECTIONS", "HEADERS", "HEADER_TIME", "configure", "encryption", "listen_encrypted"]

#: Bytes that a request's headers may have, and s within which they must have come (ours).
HEADERS, HEADER_TIME = 16_384, 10.0
#: Connections that an address may have open, sockets not counted (ours).
CONNECTIONS = 200
#: s for which a closed connection waits for a farewell by the other side, which may be asleep; less
#: than the server's own end.
_FAREWELL = 0.5
_BACKLOG = 2048


class _Connection(H11Protocol):
    """One connection that speaks HTTP."""

    _timer: asyncio.TimerHandle | None = None  # runs while no headers have come

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        if self._timer is not None:
            return  # its handshake is over; it was counted when that began
        crowd = self._crowds[self._address]
        if len(crowd) >= CONNECTIONS:
            # Never the new one: it may be a Stop.
            silent = (other for other in crowd if other._timer is not None)
            oldest = next(silent, next(iter(crowd)))
            oldest.transport.abort()
            oldest._leave()
        self._crowds[self._address][self] = None
        self._timer = self.loop.call_later(HEADER_TIME, transport.abort)

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        if self.scope is not None:  # its first headers have come
            self._hear()

    def handle_websocket_upgrade(self, event: "h11.Request") -> None:
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
        """The connections that each address has open to this server, the oldest first."""
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


class _Handshake(SSLProtocol):
    """Encrypts a connection, which counts as a silent one until its handshake is over.

    ``create_server(ssl=…)`` does the same, but tells nobody of the connection before that: who
    opens many and shakes no hand would be without a limit.
    """

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
        if self._counted.scheme != "https":  # else it was told
            self._counted.connection_lost(None)


def configure(app: ASGIApp, *, lifespan: bool = True) -> uvicorn.Config:
    """Return how an application is served; every server of ours is configured by this.

    Parameters
    ----------
    app
        What answers, behind its :class:`~miburi.interface.access.Gate`.
    lifespan
        Whether it is told of the server's start and end.
    """
    return uvicorn.Config(
        app,
        http=_Connection,
        log_level="error",  # what strangers send wrong is no news
        lifespan="on" if lifespan else "off",
        ws="websockets-sansio",
        ws_max_size=LARGEST,
        ws_per_message_deflate=False,  # a state is small; to pack it costs more than to send it
        timeout_graceful_shutdown=2,
        server_header=False,
        proxy_headers=False,  # who asks is who has connected, whatever a header says
        h11_max_incomplete_event_size=HEADERS,
        backlog=_BACKLOG,
    )


async def listen_encrypted(
    server: uvicorn.Server, listener: socket.socket, context: ssl.SSLContext
) -> None:
    """Let a server that has started listen on one more socket, by https."""
    loop = asyncio.get_running_loop()

    def made() -> _Connection:
        return _Connection(server.config, server.server_state, server.lifespan.state, loop)

    server.servers.append(
        await loop.create_server(
            lambda: _Handshake(made(), context), sock=listener, backlog=server.config.backlog
        )
    )


def encryption(certificate: Path) -> ssl.SSLContext:
    """Return what encrypts the connections of a server with its key and certificate, PEM."""
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    context.load_cert_chain(certificate)
    context.set_alpn_protocols(["http/1.1"])
    return context
