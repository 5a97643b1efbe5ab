"""A visitor's preferences, kept in the browser's cookies, and the JavaScript that sets them."""

from dataclasses import dataclass

from fastapi import Request

from miburi.studio.words import preferred

TABS = ("contact", "time", "gestures", "body")
_STRENGTH = 0.7


@dataclass(frozen=True)
class Preferences:
    """A visitor's preferences for the pages."""

    language: str  #: of the page
    dark: bool | None  #: None: as the device is set
    tab: str  #: the open panel, one of ``TABS``
    strength: float  #: how strong a short press is, 0.05 to 1
    met: bool  #: whether the visitor has read the first hint

    @classmethod
    def of(cls, request: Request) -> "Preferences":
        """Read a request's cookies; invalid values are ignored."""
        cookies = request.cookies
        wish = request.query_params.get("lang")
        accepted = request.headers.get("accept-language")
        tab = cookies.get("miburi_tab", "")
        return cls(
            preferred(wish, cookies.get("miburi_language"), accepted),
            {"1": True, "0": False}.get(cookies.get("miburi_dark", "")),
            tab if tab in TABS else TABS[0],
            _strength(cookies.get("miburi_strength", "")),
            cookies.get("miburi_met") == "1",
        )

    @property
    def scheme(self) -> str:
        """The CSS ``color-scheme`` of a page without scripts."""
        return {True: "dark", False: "light", None: "light dark"}[self.dark]


def keep(name: str, value: str) -> str:
    """Return JavaScript code that stores the expression ``value`` for a year."""
    kept = "path=/;max-age=31536000;samesite=strict"
    return f"document.cookie = `miburi_{name}=${{{value}}};{kept}`;"


def _strength(text: str) -> float:
    try:
        strength = float(text)
    except ValueError:
        return _STRENGTH
    return strength if 0.05 <= strength <= 1 else _STRENGTH
