"""Where the server listens, and the addresses at which other devices reach it."""

import errno
import socket
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from ipaddress import IPv4Address

import ifaddr

from miburi.errors import InputError, OutputError
from miburi.serving.heads import is_loopback

#: The number of connections that the kernel queues; further ones try again after a second.
_BACKLOG = 1024
#: Hosts that stand for every address of this computer.
EVERYWHERE = ("0.0.0.0", "::", "")  # noqa: S104
_HERE = "127.0.0.1"

#: Prefixes of the names of interfaces that lead to virtual machines, containers and tunnels, but
#: not to a phone.
_VIRTUAL = (
    "br-",
    "docker",
    "tailscale",
    "tap",
    "tun",
    "vbox",
    "veth",
    "virbr",
    "vmnet",
    "wg",
    "zt",
)


def own_addresses() -> list[str]:
    """Return this computer's non-loopback IPv4 addresses, the likeliest for a phone first."""
    found = {
        str(address.ip): adapter.nice_name.lower().startswith(_VIRTUAL)
        for adapter in ifaddr.get_adapters()
        for address in adapter.ips
        if isinstance(address.ip, str) and not IPv4Address(address.ip).is_loopback
    }
    leading = _leading()

    def unlikely(ip: str) -> tuple[bool, bool, bool]:
        return ip != leading, found[ip], IPv4Address(ip).is_link_local

    return sorted(found, key=unlikely)


def _leading() -> str | None:
    """Return the address of the interface with the default route, if any."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # sends nothing
        except OSError:
            return None
        return str(probe.getsockname()[0])


@dataclass(frozen=True)
class Listeners:
    """The server's listening sockets."""

    plain: tuple[socket.socket, ...]  # for http; the first is for this computer
    encrypted: socket.socket | None = None  # for https, if there is any

    @property
    def url(self) -> str:
        """The address for this computer itself."""
        return _url(self.plain[0])

    @property
    def open_to_others(self) -> bool:
        """Whether other computers may connect."""
        return self.encrypted is not None or not is_loopback(self.plain[0].getsockname()[0])

    def addresses(self) -> list[str]:
        """Return the addresses at which other devices reach the server, the likeliest first."""
        listener = self.encrypted or self.plain[0]
        scheme = "https" if self.encrypted else "http"
        host = str(listener.getsockname()[0])
        if host not in EVERYWHERE:
            return [_url(listener, scheme)] if self.open_to_others else []
        names = own_addresses() or [socket.gethostname()]
        return [f"{scheme}://{name}:{listener.getsockname()[1]}" for name in names]


@contextmanager
def listening(host: str, port: int) -> Iterator[socket.socket]:
    """Listen on a port from now on.

    Raises InputError if the host or the port is invalid; OutputError if the port is taken.
    """
    if not 0 <= port <= 65_535:
        raise InputError(f"the port must be from 0 to 65535, got {port}.")
    try:
        family, kind, *_, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    except (OSError, UnicodeError) as error:
        raise InputError(f"{host!r} is not an address of this computer: {error}.") from error
    with socket.socket(family, kind) as listener:
        if sys.platform != "win32":  # there two programs could share a port unnoticed
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind(address)
            listener.listen(_BACKLOG)
        except OSError as error:
            if error.errno == errno.EADDRNOTAVAIL:
                raise InputError(
                    f"{host} is not an address of this computer. 127.0.0.1 is for this computer "
                    "alone, 0.0.0.0 for its whole network."
                ) from error
            raise OutputError(
                f"cannot listen on {host} port {port}: {error.strerror}. If another Miburi is "
                "running, use its page or end it; or choose another port with --port, 0 for any "
                "that is free, and another folder with --folder."
            ) from error
        listener.setblocking(False)
        yield listener


@contextmanager
def listening_plainly(host: str, port: int) -> Iterator[Listeners]:
    """Listen on http alone; raises the errors of :func:`listening`."""
    with listening(host, port) as listener:
        yield Listeners((listener,))


@contextmanager
def listening_twice(host: str, port: int) -> Iterator[Listeners]:
    """Listen on http for this computer, and on https at the next port for others.

    Requests over http from elsewhere are told to use https.
    """
    with ExitStack() as sockets:
        own = sockets.enter_context(listening(_HERE, port))
        encrypted = sockets.enter_context(listening(host, port + 1 if port else 0))
        plain = [own]
        for address in own_addresses() if host in EVERYWHERE else [host]:
            with suppress(InputError, OutputError):
                plain.append(sockets.enter_context(listening(address, own.getsockname()[1])))
        yield Listeners(tuple(plain), encrypted)


def _url(listener: socket.socket, scheme: str = "http") -> str:
    host, port, *_ = listener.getsockname()
    if host in EVERYWHERE:
        host = _HERE
    return f"{scheme}://{f'[{host}]' if ':' in host else host}:{port}"
