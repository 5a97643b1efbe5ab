"""Trust and failures in a client's TLS connections."""

import ssl
from pathlib import Path
from typing import Literal
from urllib.parse import SplitResult, urlsplit

from websockets.exceptions import ConnectionClosed, InvalidMessage

from miburi.errors import InputError


def trust(url: str, authority: Path | str | None) -> ssl.SSLContext | Literal[False]:
    """Return HTTPX's ``verify``: a TLS context with the authorities to trust.

    For plain http, the value is False, because loading authorities takes 30 ms.

    Raises the errors of :func:`miburi.client.remote.connect`.
    """
    try:
        parts = urlsplit(url)
    except ValueError as error:
        raise InputError(f"this is not a valid address: {url!r} ({error}).") from error
    scheme = parts.scheme
    if scheme not in ("http", "https"):
        raise InputError(f"a partner's address starts with http:// or https://, got {url!r}.")
    if not _has_port(parts) or parts.path.rstrip("/").endswith("/api/v1"):
        raise InputError(
            f"a partner's address is like http://127.0.0.1:8080, without /api/v1; got {url!r}."
        )
    if scheme == "http":
        return False
    try:
        return ssl.create_default_context(cafile=authority)
    except OSError as error:
        raise InputError(
            f"{authority}: this is not an authority's certificate (PEM): {error}."
        ) from error


def bearer(token: str | None) -> dict[str, str]:
    """Return the header with a token, without the spaces and the newline of the file it is from.

    Raises InputError, without the token, if no header can carry it.
    """
    token = (token or "").strip()
    if not (token.isascii() and token.isprintable()):
        raise InputError("a token is one line of letters, digits and signs (ASCII); copy it again.")
    return {"Authorization": f"Bearer {token}"} if token else {}


def _has_port(parts: SplitResult) -> bool:
    """Whether the port is valid or, as behind a proxy, missing."""
    try:
        return parts.port is None or parts.port > 0
    except ValueError:
        return False


def distrust(url: str, error: BaseException) -> str | None:
    """Return advice if a connection failed because its certificate is not trusted; else None."""
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, ssl.SSLCertVerificationError):
        cause = cause.__cause__ or cause.__context__
    if cause is None:
        return None
    return (
        f"{url}: this computer does not trust its certificate ({cause.verify_message}). Download "
        f"{url}/ca.pem (or copy https/ca.pem from the partner's folder) and pass that file: "
        "connect(url, token, authority=FILE), or MIBURI_AUTHORITY=FILE for commands."
    )


def has_collided(error: BaseException) -> bool:
    """Whether a WebSocket has failed in TLS after its handshake.

    The threads of ``websockets`` read and write one ssl socket at once, which Python's ssl does not
    allow (python/cpython#76714). After a handshake, the partner is reachable and trusted.
    """
    if not isinstance(error, ConnectionClosed | InvalidMessage):
        return False
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, ssl.SSLError):
        cause = cause.__cause__
    return cause is not None
