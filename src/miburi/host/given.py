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
        The server's listening sockets.
    reach
        The addresses, keys and authority for other devices.
    doors
        The doors (other protocols) that are open besides HTTP.
    folder
        The folder of the token and the certificates.
    certificate
        The PEM file with the key and the certificate, if it serves https.
    passage
        The socket by which the reception, the process that accepts connections, hands them over;
        None if the server accepts them itself.
    """

    listeners: Listeners
    reach: Reach
    doors: Doors
    folder: Path
    certificate: Path | None = None
    passage: socket.socket | None = None
