"""The arguments of the server's process."""

import socket
from dataclasses import dataclass
from pathlib import Path

from miburi.doors.doors import Doors
from miburi.serving.addresses import Listeners
from miburi.serving.reach import Reach

__all__ = ["Pages"]


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
