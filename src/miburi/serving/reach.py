"""The server's addresses for other devices, also as QR codes; this needs no web library."""

import sys
from dataclasses import dataclass
from io import StringIO

import segno

from miburi.serving.access import PAIRING
from miburi.serving.keys import Keys


@dataclass
class Reach:
    """The server's addresses for other devices; updated in place while the server runs.

    Without keys, the server listens only to this computer.
    """

    addresses: tuple[str, ...] = ()  # the likeliest first
    keys: Keys | None = None
    authority: bytes | None = None  # the local authority's certificate, PEM, if there is https
    fingerprint: str = ""  # its SHA-256, as phones show it

    @property
    def token(self) -> str | None:
        """The present pairing token; None if the server listens only to this computer."""
        return None if self.keys is None else self.keys.token


def pairing_url(address: str, token: str, page: str = "/") -> str:
    """Return the address that pairs a device and opens ``page``.

    The token comes after the ``#``. Browsers do not send what follows a ``#``, so no log can keep
    the token.
    """
    return f"{address}{PAIRING}#{token}{page}"


def qr_for_terminal(text: str) -> str:
    """Return a QR code as text for a terminal."""
    out = StringIO()
    segno.make(text, error="m").terminal(out, compact=True)
    return out.getvalue()


def way_in(address: str, token: str) -> str:
    """Return what a phone's user does to get in; only on a terminal does that contain the token.

    Others may read a file or a journal.
    """
    if not sys.stdout.isatty():
        return f"open {address}{PAIRING} and type the token"
    url = pairing_url(address, token)
    return f"scan this or open {url}\n{qr_for_terminal(url)}"


def qr_svg(text: str) -> str:
    """Return a QR code as SVG, black on white."""
    return segno.make(text, error="m").svg_inline(scale=6, border=3, light="white")
