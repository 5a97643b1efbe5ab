"""The arguments of the server's process."""

import socket
from dataclasses import dataclass
from pathlib import Path

from miburi.doors.doors import Doors
from miburi.serving.addresses import Listeners
from miburi.serving.reach import Reach


@dataclass(frozen=True)
class Pages:
    """The settings of the server's process.

    Attributes
    ----------
    listeners
        The addresses at which programs and devices find it.
    reach
        The addresses, keys and local authority by which other devices connect.
    doors
        The doors (other protocols) that are open besides HTTP.
    folder
        The folder of the token and the certificates.
    certificate
        The key and the certificate, PEM, if it serves https.
    passage
        Hands over connections from the reception, the process that accepts them; None if the server
        accepts them itself.
    """

    listeners: Listeners
    reach: Reach
    doors: Doors
    folder: Path
    certificate: Path | None = None
    passage: socket.socket | None = None
