"""The process of the server: what it is given, and how it begins; web libraries stay in there."""

import gc
import socket
from dataclasses import dataclass
from pathlib import Path

from miburi.ground.cores import come_first
from miburi.interface.doors import Doors
from miburi.interface.reach import Reach
from miburi.live.crossing import Lanes
from miburi.studio.addresses import Listeners

__all__ = ["Pages", "serve_pages"]


@dataclass(frozen=True)
class Pages:
    """What the server is given.

    Attributes
    ----------
    listeners
        Where others find it.
    reach
        How other devices reach it.
    doors
        The doors that are open beside HTTP.
    folder
        Where token and certificates are kept.
    certificate
        Its key and certificate, PEM, if it listens by https.
    passage
        Brings the connections that a reception passes on; None: it listens itself.
    """

    listeners: Listeners
    reach: Reach
    doors: Doors
    folder: Path
    certificate: Path | None = None
    passage: socket.socket | None = None


def serve_pages(pages: Pages, ends: Lanes) -> None:
    """Serve until SIGTERM, or until the partner's process has ended."""
    come_first(apart=True)
    gc.disable()  # nothing of a library that is being loaded is waste
    from miburi.studio.serving import serve_until_the_end  # takes a second; the partner wakes

    serve_until_the_end(pages, ends)
