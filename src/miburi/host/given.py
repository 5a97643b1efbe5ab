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
        The addresses at which programs and devices find it.
    reach
        The rules and keys by which other devices may reach it.
    doors
        The doors (other protocols) that are open besides HTTP.
    folder
        Where token and certificates are kept.
    certificate
        The key and the certificate, PEM, if it serves https.
    passage
        Brings connections from the reception process; None if the server listens itself.
    """

    listeners: Listeners
    reach: Reach
    doors: Doors
    folder: Path
    certificate: Path | None = None
    passage: socket.socket | None = None
