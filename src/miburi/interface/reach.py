"""How other devices reach the server, as an address or a code to scan; no web library is needed."""

from dataclasses import dataclass
from io import StringIO

import segno

from miburi.interface.access import PAIRING

__all__ = ["Reach", "pairing_url", "qr_for_terminal", "qr_svg"]


@dataclass
class Reach:
    """How other devices reach the server; what changes while it runs is changed in place.

    Attributes
    ----------
    addresses
        Where, the likeliest first; none on the loopback address.
    token
        What they need; None on the loopback address.
    authority
        The certificate of the home authority, PEM, if they come by https; else None.
    fingerprint
        Its SHA-256, as phones show it.
    """

    addresses: tuple[str, ...] = ()
    token: str | None = None
    authority: bytes | None = None
    fingerprint: str = ""


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
