"""An MQTT broker: its address and credentials.

The password comes from the environment or from a file: every user of the computer could read a
command line.
"""

import asyncio
import os
import re
import ssl
import sys
import time
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote, urlsplit

from miburi.errors import InputError

if TYPE_CHECKING:
    import aiomqtt


#: The variable with the password; with _FILE appended, the variable with the name of its file.
PASSWORD = "MIBURI_BROKER_PASSWORD"  # noqa: S105 a name, not a password
_PORTS = {"mqtt": 1883, "mqtts": 8883}
#: Keep-alive, in s: after one and a half times this, the broker considers a silent partner lost.
_KEEP_ALIVE = 10
#: The first and the longest wait for an unreachable broker, in s (our choice).
_FIRST_PAUSE, _LONGEST_PAUSE = 1.0, 30.0
#: A failure that goes on is logged again after this time, in s (our choice).
_TOLD_AGAIN = 3600.0
#: MQTT's codes for a wrong user or password, and for a user who may not connect.
_REFUSED = (134, 135)


@dataclass(frozen=True)
class Broker:
    """A broker's address, our credentials, and the group of partners, if there is one."""

    host: str
    port: int
    tls: bool = False
    ca: Path | None = None
    user: str | None = None
    password: str | None = field(default=None, repr=False)
    group: str | None = None

    def path(self, name: str) -> str:
        """Return a partner's name, preceded by the group's name, if any."""
        return name if self.group is None else f"{self.group}/{name}"

    def client(
        self, identifier: str | None, will: "aiomqtt.Will | None" = None
    ) -> "aiomqtt.Client":
        """Return an unconnected client; it needs the extra ``mqtt``."""
        import aiomqtt

        return aiomqtt.Client(
            self.host,
            self.port,
            username=self.user,
            password=self.password,
            identifier=identifier,
            will=will,
            keepalive=_KEEP_ALIVE,
            tls_context=_tls(self.ca) if self.tls else None,
        )


def find_broker(
    address: str, ca: Path | None = None, environment: Mapping[str, str] = os.environ
) -> Broker:
    """Return the broker at an address, with the password from the environment.

    The address is ``[mqtt://|mqtts://][USER@]HOST[:PORT][/GROUP]``; mqtts means TLS. The file
    ``ca`` has the certificates to trust, by default the system's.

    Raises InputError if the address is not valid or contains a password, or a file cannot be read.
    """
    text = address if "://" in address else f"mqtt://{address}"
    try:
        parts = urlsplit(text)
        port = parts.port
    except ValueError as error:
        raise _not_an_address(address) from error
    if parts.scheme not in _PORTS or not parts.hostname or "/" in parts.path.strip("/"):
        raise _not_an_address(address)
    if parts.password is not None:
        raise InputError(
            "a password on the command line can be read by others; give it in the variable "
            f"{PASSWORD}, or the name of its file in {PASSWORD}_FILE."
        )
    if ca is not None and parts.scheme == "mqtt":
        raise InputError("certificates are for TLS; write the broker as mqtts://HOST.")
    group = parts.path.strip("/")
    tls = parts.scheme == "mqtts"
    if tls:
        _tls(ca)  # refuse a wrong file now
    return Broker(
        parts.hostname,
        port or _PORTS[parts.scheme],
        tls,
        ca,
        unquote(parts.username) if parts.username else None,
        _password(environment),
        check_name(group) if group else None,
    )


async def stay_at(
    broker: Broker,
    identifier: str | None,
    live: Callable[["aiomqtt.Client"], Awaitable[None]],
    will: "aiomqtt.Will | None" = None,
    admit: Callable[[], Awaitable[None]] | None = None,
    clock: Callable[[], float] = time.monotonic,
    pause: Callable[[float], Awaitable[None]] = asyncio.sleep,
) -> None:
    """Stay connected to a broker until cancelled; say why a connection ended, and reconnect.

    Before each connection, ``admit`` raises an error if we must not connect; ``live`` then uses the
    connection until it ends. If we vanish without disconnecting, the broker publishes our ``will``.
    The same reason is logged at most once an hour. ``clock`` returns the time and
    ``pause`` lets it pass, in s.
    """
    wait, said, said_at = _FIRST_PAUSE, "", 0.0
    while True:
        try:
            if admit is not None:
                await admit()
            async with broker.client(identifier, will) as client:
                wait = _FIRST_PAUSE
                await live(client)
        except* Exception as group:  # a failure here must not end the rest
            why = "; ".join(_reason(broker, one) for one in group.exceptions)
            if why != said or clock() - said_at >= _TOLD_AGAIN:
                said, said_at = why, clock()
                print(
                    f"miburi: the broker at {broker.host}:{broker.port}: {why}. Trying again.",
                    file=sys.stderr,
                    flush=True,
                )
        await pause(wait)
        wait = min(2 * wait, _LONGEST_PAUSE)


def _reason(broker: Broker, error: Exception) -> str:
    """Return why a connection failed; if the user was refused, also what to look at."""
    why = str(error) or type(error).__name__
    if getattr(getattr(error, "rc", None), "value", None) not in _REFUSED:
        return why
    user = "a client without a user" if broker.user is None else f"the user {broker.user!r}"
    return (
        f"it refuses {user} ({why}); check USER in --broker USER@HOST, and the password in "
        f"{PASSWORD} or in the file that {PASSWORD}_FILE names"
    )


def check_name(name: str) -> str:
    """Return the name of a partner or a group, if it is valid in a topic.

    Raises InputError if the name is not valid, or means all partners.
    """
    if not re.fullmatch(r"[a-z0-9][a-z0-9_-]{0,39}", name) or name == "all":
        raise InputError(
            "a partner's or a group's name has 1 to 40 of a-z, 0-9, _ and -, and is not 'all'; "
            f"got {name!r}."
        )
    return name


def _not_an_address(address: str) -> InputError:
    return InputError(
        f"a broker's address is [mqtt://|mqtts://][USER@]HOST[:PORT][/GROUP], got {address!r}."
    )


def _tls(ca: Path | None) -> ssl.SSLContext:
    try:
        return ssl.create_default_context(cafile=ca)
    except (OSError, ssl.SSLError) as error:
        raise InputError(f"{ca}: these certificates cannot be read: {error}.") from error


def _password(environment: Mapping[str, str]) -> str | None:
    file = environment.get(PASSWORD + "_FILE")
    if file is None:
        return environment.get(PASSWORD)
    try:
        return Path(file).read_text(encoding="utf-8").rstrip("\n")
    except (OSError, UnicodeError) as error:
        raise InputError(f"{file}: the password cannot be read: {error}.") from error
