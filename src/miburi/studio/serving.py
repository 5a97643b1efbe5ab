"""The server's process: pages and interface of a partner whose loop runs in another process."""

import gc
import signal
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

import uvicorn

from miburi.ground.cores import come_first
from miburi.interface.access import Gate
from miburi.interface.doors import Doors
from miburi.interface.http import configure, encryption, listen_encrypted
from miburi.interface.pairing import Reach
from miburi.live.crossing import Lanes
from miburi.live.far import FarPartner
from miburi.live.view import UnreachableError
from miburi.studio.addresses import Listeners

__all__ = ["Pages", "serve_pages"]


@dataclass(frozen=True)
class Pages:
    """What the server is given.

    Attributes
    ----------
    listeners
        The sockets on which it listens.
    reach
        How other devices reach it.
    doors
        The doors that are open beside HTTP.
    certificate
        Its key and certificate, PEM, if it listens by https.
    """

    listeners: Listeners
    reach: Reach
    doors: Doors
    certificate: Path | None = None


def serve_pages(pages: Pages, ends: Lanes) -> None:
    """Serve until SIGTERM, or until the partner's process has ended."""
    come_first(apart=True)
    from miburi.studio.app import make_app  # this takes a second, in which the partner wakes

    try:
        partner = FarPartner(ends)
    except UnreachableError:
        return  # it could not begin, and has said why
    app = make_app(partner, pages.reach, pages.doors)
    gate = Gate(app, pages.reach.token, https=pages.certificate is not None)
    server = _Server(configure(gate), partner, pages)
    threading.Thread(target=_end_with, args=(partner, server), daemon=True).start()
    server.run(sockets=list(pages.listeners.plain))


def _end_with(partner: FarPartner, server: uvicorn.Server) -> None:
    partner.over.wait()
    server.should_exit = True


class _Server(uvicorn.Server):
    """Tells the partner's process that it listens and serves; SIGTERM is a good end."""

    def __init__(self, config: uvicorn.Config, partner: FarPartner, pages: Pages) -> None:
        super().__init__(config)
        self._partner, self._pages = partner, pages

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begin to listen, and say so."""
        await super().startup(sockets)
        encrypted, certificate = self._pages.listeners.encrypted, self._pages.certificate
        if encrypted is not None and certificate is not None:
            await listen_encrypted(self, encrypted, encryption(certificate))
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
