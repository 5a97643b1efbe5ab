"""Other origins whose pages the user allows to use the interface, by CORS."""

import re
from collections.abc import Mapping

from miburi.errors import InputError

Headers = list[tuple[bytes, bytes]]

#: The only paths that pages of other origins may request.
API = "/api/v1/"
_PERMITTED = [
    (b"access-control-allow-methods", b"GET, POST, DELETE"),
    (b"access-control-allow-headers", b"authorization, content-type, last-event-id, miburi-by"),
    (b"access-control-max-age", b"600"),
]
_ORIGIN = re.compile(r"https?://([a-z0-9.-]+|\[[0-9a-f:.]+\])(:[0-9]{1,5})?")
_NEAR = b"access-control-request-private-network"


def check_origin(text: str) -> str:
    """Return an origin such as ``https://example.org`` or ``http://localhost:5173``.

    Raises InputError if the text is not an origin, or it is ``*``, which would admit every page.
    """
    origin = text.lower()
    if not _ORIGIN.fullmatch(origin):
        raise InputError(
            f"an origin is a scheme, a host and perhaps a port, such as https://example.org or "
            f"http://localhost:5173; got {text[:60]!r}."
        )
    default = {"http": ":80", "https": ":443"}[origin.partition(":")[0]]
    return origin.removesuffix(default)  # browsers leave it out


def cors(origin: str) -> Headers:
    """Return the headers that let a page from this origin read a response."""
    return [(b"access-control-allow-origin", origin.encode()), (b"vary", b"Origin")]


def permit(origin: str, headers: Mapping[bytes, str]) -> Headers:
    """Return the headers that answer a browser's preflight request."""
    near = [(b"access-control-allow-private-network", b"true")] if _NEAR in headers else []
    return [*cors(origin), *_PERMITTED, *near]
