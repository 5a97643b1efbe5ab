"""A language model's endpoint: the address of an OpenAI-compatible server, a model, and a key.

The key comes from the environment, as every user of the computer could read it on a command line.
"""

import os
import ssl
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from ipaddress import ip_address
from urllib.parse import urlsplit

from miburi.errors import InputError, MiburiError

#: The environment variable with the key.
KEY = "MIBURI_TALK_KEY"
#: Suffixes of host names in home networks (RFC 6762, RFC 8375, and those that routers use).
_AT_HOME = (".local", ".home.arpa", ".lan", ".home", ".internal", ".localhost")
_LONGEST = 200


class OvertakenError(MiburiError):
    """A newer remark is answered instead."""


@dataclass(frozen=True)
class Endpoint:
    """A server, the model to use there, and the key to it.

    Attributes
    ----------
    url
        The base address, such as ``http://localhost:11434/v1``; requests go to its
        ``/chat/completions``.
    model
        The model's name there.
    key
        Sent as a bearer token; None if the server asks for none.
    """

    url: str
    model: str
    key: str | None = field(default=None, repr=False)

    def __str__(self) -> str:
        return f"{self.url} (model {self.model})"

    @cached_property
    def tls(self) -> ssl.SSLContext:
        """The system's trusted certificates."""
        return ssl.create_default_context()


def find_endpoint(url: str, model: str, environment: Mapping[str, str] = os.environ) -> Endpoint:
    """Return the endpoint at an address, with the key from the environment.

    Outside private networks the address must be ``https://``, or others could read the conversation
    and the key.

    Raises InputError if the address is not valid or not safe, or if the model or the key is not
    allowed.

    Parameters
    ----------
    url
        The base address; one without a path gets ``/v1``.
    """
    try:
        parts = urlsplit(url)
        host, port = parts.hostname, parts.port
        url.encode("ascii")
    except ValueError as error:
        raise _not_an_address(url) from error
    if parts.scheme not in ("http", "https") or not host or port == 0 or not url.isprintable():
        raise _not_an_address(url)
    if parts.username is not None or parts.password is not None:
        raise InputError(
            f"an address with a password can be read by others; give a key in the variable {KEY}."
        )
    if parts.query or parts.fragment or " " in url or len(url) > _LONGEST:
        raise _not_an_address(url)
    if parts.scheme == "http" and not _is_at_home(host):
        raise InputError(
            f"--talk must be https:// for a server outside your home, or others could read what "
            f"you say; got {url}. http:// is for this computer and private networks."
        )
    if not model.strip() or len(model) > _LONGEST or not model.isprintable():
        raise InputError(f"--model must be a model's name of 1 to {_LONGEST} characters.")
    key = environment.get(KEY) or None
    if key is not None and not (key.isascii() and key.isprintable() and " " not in key):
        raise InputError(f"the key in {KEY} must be printable ASCII without spaces.")
    return Endpoint(
        url.rstrip("/") if parts.path.strip("/") else f"{url.rstrip('/')}/v1", model, key
    )


def _not_an_address(url: str) -> InputError:
    return InputError(
        f"--talk must be the base address of a server, such as http://localhost:11434/v1, "
        f"got {url[:_LONGEST]!r}."
    )


def _is_at_home(host: str) -> bool:
    """Whether a host is this computer, or is on a private network."""
    try:
        address = ip_address(host.partition("%")[0])
    except ValueError:
        name = host.lower().rstrip(".")
        return ("." not in name and not name[0].isdigit()) or name.endswith(_AT_HOME)
    return not address.is_global and not address.is_multicast
