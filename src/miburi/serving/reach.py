"""How other devices reach the server, as an address or a code to scan; no web library is needed."""

from dataclasses import dataclass
from io import StringIO

import segno

from miburi.serving.access import PAIRING
from miburi.serving.keys import Keys

__all__ = ["Reach", "pairing_url", "qr_for_terminal", "qr_svg"]


@dataclass
class Reach:
    """How other devices reach the server; what changes while it runs is changed in place.

    Attributes
    ----------
    addresses
        The server's addresses, the likeliest first; none on the loopback address.
    keys
        Keys, of which each device needs one; None on the loopback address.
    authority
        The certificate of the home authority, PEM, if other devices connect over https; else None.
    fingerprint
        Its SHA-256, as phones show it.
    """

    addresses: tuple[str, ...] = ()
    keys: Keys | None = None
    authority: bytes | None = None
    fingerprint: str = ""

    @property
    def token(self) -> str | None:
        """The token that pairs a device now; None on the loopback address."""
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
