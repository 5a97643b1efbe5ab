"""The pairing page, for a device that has no token yet: such a device can load little else here."""

from pathlib import Path

from fastapi import Request

from miburi.ground.templates import render
from miburi.serving.reach import Reach
from miburi.studio.preferences import Preferences
from miburi.studio.words import words

__all__ = ["pairing_page"]

_PAGE = Path(__file__).with_suffix(".html")


def pairing_page(reach: Reach, request: Request) -> str:
    """Return the page in the visitor's language."""
    language = Preferences.of(request).language
    return render(
        _PAGE,
        language=language,
        words=words(language)["pairing"],
        privacy=words(language)["privacy"]["link"],
        encrypted=request.url.scheme == "https",
        onward=_onward(reach, request),
        fingerprint=reach.fingerprint,
    )


def _onward(reach: Reach, request: Request) -> str | None:
    """Return the https address to redirect a visitor to; None if the page is right as it is."""
    if reach.authority is None or request.url.scheme == "https" or not reach.addresses:
        return None
    found = str((request.scope.get("server") or ("",))[0])
    same = [address for address in reach.addresses if f"//{found}:" in address]
    return (same or list(reach.addresses))[0]
