"""How the server listens: what it grants a connection before anybody knows who asks.

Headers are limited in size, and must come within a time. An address has so many connections:
when one more comes, its oldest silent one gives way, so that who opens many and says nothing
keeps nobody out.
"""

import asyncio
import itertools

import uvicorn
from starlette.types import ASGIApp
from uvicorn.protocols.http.h11_impl import H11Protocol

from miburi.interface.access import LARGEST

__all__ = ["CONNECTIONS", "HEADERS", "HEADER_TIME", "configure"]

#: Bytes that a request's headers may have, and s within which they must have come (ours).
HEADERS, HEADER_TIME = 16_384, 10.0
#: Connections that an address may have open, sockets not counted (ours).
CONNECTIONS = 200
_BACKLOG = 2048
_NUMBERS = itertools.count()


class _Connection(H11Protocol):
    """One connection that speaks HTTP."""

    _timer: asyncio.TimerHandle | None = None  # runs while no headers have come
    _number = 0  # counts up; many may come at one time of the loop's clock

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._number = next(_NUMBERS)
        mine = [
            other
            for other in self.connections
            if isinstance(other, _Connection)
            and other._address == self._address
            and not other.transport.is_closing()  # it has given way already
        ]
        silent = [other for other in mine if other._timer is not None]
        if len(mine) > CONNECTIONS:
            # Never the new one: it may be a Stop.
            min(silent or mine, key=lambda other: other._number).transport.abort()
        self._timer = self.loop.call_later(HEADER_TIME, transport.abort)

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        if self.scope is not None:  # its first headers have come
            self._hear()

    def connection_lost(self, exc: Exception | None) -> None:
        self._hear()
        super().connection_lost(exc)

    @property
    def _address(self) -> str:
        return self.client[0] if self.client else ""

    def _hear(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None


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
