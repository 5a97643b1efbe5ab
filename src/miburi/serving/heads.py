"""A request's headers, and whether its host and origin are allowed."""

from ipaddress import ip_address
from urllib.parse import SplitResult, urlsplit

from starlette.types import Scope

COOKIE = "miburi_token"


def is_loopback(host: str) -> bool:
    """Whether a host name or address means this computer alone."""
    try:
        return ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host.lower() == "localhost"


class RefusedError(Exception):
    """A request that the gate refuses."""

    def __init__(self, status: int, words: str) -> None:
        super().__init__(words)
        self.status = status


class WrongTokenError(RefusedError):
    """A request whose token is wrong."""


def headers_of(scope: Scope) -> dict[bytes, str]:
    """Return a request's headers as text."""
    return {name: value.decode("latin-1") for name, value in scope["headers"]}


def check_host(headers: dict[bytes, str], *, near: bool) -> None:
    """Refuse a host name that is not a loopback name, if ``near`` (on the loopback address)."""
    host = headers.get(b"host", "")
    if near and not is_loopback(_split(f"//{host}").hostname or ""):
        raise RefusedError(
            403,
            "this server answers to localhost only; start it with --https or --host to open it.",
        )


def check_site(headers: dict[bytes, str], *, encrypted: bool) -> None:
    """Refuse a request from another site's page; ``encrypted`` tells whether it came by https."""
    host, origin = headers.get(b"host", ""), headers.get(b"origin")
    # For an image or a script, a browser sends Sec-Fetch-Site, but no Origin.
    foreign = headers.get(b"sec-fetch-site", "none") not in ("same-origin", "none")
    if origin is not None:
        page = _split(origin)
        # Over plain http, anybody between client and server can forge a page of this server.
        foreign |= page.netloc != host or (encrypted and page.scheme != "https")
    if foreign:
        raise RefusedError(
            403,
            "requests from other sites' pages are refused; `miburi run --allow-origin` lets pages "
            "of the sites that you list use the interface.",
        )


def int_or(text: str | None, otherwise: int) -> int:
    """Return the whole number in ``text``, or ``otherwise``."""
    return int(text) if text is not None and text.isascii() and text.isdigit() else otherwise


def asker(scope: Scope) -> str:
    """Return the address that a request comes from."""
    return str((scope.get("client") or ("?", 0))[0])


def is_own(scope: Scope) -> bool:
    """Whether a connection was made to the loopback address."""
    return is_loopback(str((scope.get("server") or ("",))[0]))


def tokens_of(headers: dict[bytes, str]) -> list[str]:
    """Return the tokens in a request's header, or else in cookies with our name.

    Other cookies on this host are skipped, even malformed ones.
    """
    scheme, _, value = headers.get(b"authorization", "").partition(" ")
    if scheme.lower() == "bearer" and value:
        return [value.strip()]
    pairs = (pair.strip().partition("=") for pair in headers.get(b"cookie", "").split(";"))
    return [value.strip('"') for name, _, value in pairs if name == COOKIE]


def _split(url: str) -> SplitResult:
    try:
        return urlsplit(url)
    except ValueError:
        raise RefusedError(403, "the host or the origin is malformed.") from None


def has_headers(scope: Scope, headers: dict[bytes, bytes]) -> bool:
    """Whether a request has all these headers."""
    return headers.items() <= dict(scope["headers"]).items()
