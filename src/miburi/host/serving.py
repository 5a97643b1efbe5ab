"""The server's process: pages and interface of a partner whose loop runs in another process."""

import asyncio
import gc
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from functools import partial
from types import FrameType

import uvicorn

from miburi.host.given import Pages
from miburi.interface.events import ENDING
from miburi.live.crossing.far import FarPartner
from miburi.live.crossing.lanes import Lanes
from miburi.live.events.store import kept_events
from miburi.live.view import UnreachableError
from miburi.serving.access import Gate
from miburi.serving.http import Passage, configure, encryption, listen_encrypted
from miburi.serving.renewal import EVERY, Renewal
from miburi.studio.app import make_app


def serve_until_the_end(pages: Pages, ends: Lanes) -> None:
    """Serve until SIGTERM, or until the partner's process has ended."""
    try:
        partner = FarPartner(ends, open_store=partial(kept_events, pages.folder, quiet=True))
    except UnreachableError:
        return  # the partner could not begin, and has reported why
    app = make_app(partner, pages.reach, pages.doors, pages.folder)
    https = pages.certificate is not None
    gate = Gate(app, pages.reach.keys, https=https, origins=pages.doors.origins)
    server = _Server(configure(gate), partner, pages, lambda: setattr(app.state, ENDING, True))
    threading.Thread(target=_end_with, args=(partner, server), daemon=True).start()
    server.run(sockets=[] if pages.passage else list(pages.listeners.plain))


async def _keep_up(renewal: Renewal) -> None:
    while True:
        await asyncio.sleep(EVERY)
        await asyncio.to_thread(renewal.look, datetime.now(UTC))


def _end_with(partner: FarPartner, server: uvicorn.Server) -> None:
    partner.over.wait()
    server.should_exit = True


class _Server(uvicorn.Server):
    """A server that reports to the partner's process, and ends cleanly on SIGTERM."""

    def __init__(
        self,
        config: uvicorn.Config,
        partner: FarPartner,
        pages: Pages,
        say_that_it_ends: Callable[[], None],
    ) -> None:
        super().__init__(config)
        self._partner, self._pages, self._say_that_it_ends = partner, pages, say_that_it_ends
        self._passage: Passage | None = None

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begin to listen, and report it."""
        await super().startup(sockets)
        pages = self._pages
        encrypted, certificate = pages.listeners.encrypted, pages.certificate
        context = None if certificate is None else encryption(certificate)
        if pages.passage is not None:
            self._passage = Passage(pages.passage, self, context)
        elif encrypted is not None and context is not None:
            await listen_encrypted(self, encrypted, context)
        renewal = Renewal(pages.listeners, pages.folder, pages.reach, context, certificate)
        self._renewing = asyncio.create_task(_keep_up(renewal))
        gc.enable()
        gc.freeze()  # else a Stop might wait 0.07 s for a garbage collection
        self._partner.tell_ready()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Accept no new connections, and close the open ones."""
        self._say_that_it_ends()
        if self._passage is not None:
            self._passage.close()
        await super().shutdown(sockets)

    async def on_tick(self, counter: int) -> bool:
        """Send the partner's process a heartbeat, ten times a second."""
        self._partner.beat()
        return await super().on_tick(counter)

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Handle SIGTERM while the server runs; uvicorn would raise it again."""
        kept = signal.signal(signal.SIGTERM, self._end)
        try:
            yield
        finally:
            signal.signal(signal.SIGTERM, kept)

    def _end(self, number: int, frame: FrameType | None) -> None:
        self.handle_exit(number, frame)
