"""The server's process: pages and interface of a partner whose loop runs in another process."""

import gc
import signal
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

import uvicorn

from miburi.ground.cores import come_first
from miburi.interface.access import Gate
from miburi.interface.doors import Doors
from miburi.interface.http import configure
from miburi.live.crossing import Lanes
from miburi.live.far import FarPartner
from miburi.live.view import UnreachableError

__all__ = ["Pages", "serve_pages"]


@dataclass(frozen=True)
class Pages:
    """What the server is given.

    Attributes
    ----------
    listener
        The socket on which it listens.
    addresses
        The addresses at which other devices reach it.
    token
        The token that they need; None on the loopback address.
    doors
        The doors that are open beside HTTP.
    """

    listener: socket.socket
    addresses: list[str]
    token: str | None
    doors: Doors


def serve_pages(pages: Pages, ends: Lanes) -> None:
    """Serve until SIGTERM, or until the partner's process has ended."""
    come_first(apart=True)
    from miburi.studio.app import make_app  # this takes a second, in which the partner wakes

    try:
        partner = FarPartner(ends)
    except UnreachableError:
        return  # it could not begin, and has said why
    app = make_app(partner, pages.addresses, pages.token, pages.doors)
    server = _Server(configure(Gate(app, pages.token)), partner)
    threading.Thread(target=_end_with, args=(partner, server), daemon=True).start()
    server.run(sockets=[pages.listener])


def _end_with(partner: FarPartner, server: uvicorn.Server) -> None:
    partner.over.wait()
    server.should_exit = True


class _Server(uvicorn.Server):
    """Tells the partner's process that it listens and serves; SIGTERM is a good end."""

    def __init__(self, config: uvicorn.Config, partner: FarPartner) -> None:
        super().__init__(config)
        self._partner = partner

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begin to listen, and say so."""
        await super().startup(sockets)
        gc.freeze()  # to look through all that was loaded takes 0.07 s, which a Stop would wait
        self._partner.tell_ready()

    async def on_tick(self, counter: int) -> bool:
        """Tell that the server serves, ten times a second."""
        self._partner.beat()
        return await super().on_tick(counter)

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Take SIGTERM while the server runs; uvicorn would raise it again."""
        kept = signal.signal(signal.SIGTERM, self._end)
        try:
            yield
        finally:
            signal.signal(signal.SIGTERM, kept)

    def _end(self, number: int, frame: FrameType | None) -> None:
        self.handle_exit(number, frame)
