"""How other devices reach the server, as addresses or a code to scan; needs no web library."""

from dataclasses import dataclass
from io import StringIO

import segno

from miburi.serving.access import PAIRING
from miburi.serving.keys import Keys

__all__ = ["Reach", "pairing_url", "qr_for_terminal", "qr_svg"]


@dataclass
class Reach:
    """How other devices reach the server; it is updated in place while the server runs.

    Attributes
    ----------
    addresses
        The server's addresses, those most likely to work first; none if it listens only to this
        computer.
    keys
        Keys, one for each device; None if the server listens only to this computer.
    authority
        The certificate of the local authority, PEM, if other devices connect over https; else None.
    fingerprint
        Its SHA-256, as phones show it.
    """

    addresses: tuple[str, ...] = ()
    keys: Keys | None = None
    authority: bytes | None = None
    fingerprint: str = ""

    @property
    def token(self) -> str | None:
        """The token that pairs a device now; None if the server listens only to this computer."""
        return None if self.keys is None else self.keys.token


def pairing_url(address: str, token: str, page: str = "/") -> str:
    """Return the address that pairs a device and opens ``page``.

    The token comes after the ``#``. Browsers do not send that part, so no log can keep it.
    """
    return f"{address}{PAIRING}#{token}{page}"


def qr_for_terminal(text: str) -> str:
    """Return a QR code as text for a terminal."""
    out = StringIO()
    segno.make(text, error="m").terminal(out, compact=True)
    return out.getvalue()


def qr_svg(text: str) -> str:
    """Return a QR code as SVG, black on white."""
    return segno.make(text, error="m").svg_inline(scale=6, border=3, light="white")
