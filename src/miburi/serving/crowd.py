"""The open connections in the reception, by address, and how it chooses which to close."""

import errno
import logging
from collections import defaultdict
from collections.abc import Callable

from miburi.serving.access import CONNECTIONS
from miburi.serving.files import lasting_of
from miburi.serving.passing import ENCRYPTED
from miburi.serving.relay import Guest

#: For how long, in s, a new connection is not closed to make room for newer ones (our choice).
GRACE = 0.5
#: The most HTTPS handshakes in progress, from all addresses: each takes 0.33 MB of the server's
#: memory (our choice).
HANDSHAKES = 100
#: At most this many connections are read in search of one that carries no Stop and can be closed.
_READ = 64

_LOG = logging.getLogger(__name__)
_FULL = (
    "no more than %d files may be open for connections, so for each new connection another is "
    "closed; raise the limit of open files (ulimit -n)."
)
_ByAddress = defaultdict[str, dict[Guest, None]]


class Crowd:
    """All guests (connections), and the file descriptors that they use.

    Parameters
    ----------
    most
        The largest number of open files.
    clock
        Returns the time in s.
    hear
        Reads a guest's data, which may be a Stop.
    close
        Closes a guest, and calls :meth:`leave` for it.
    """

    def __init__(
        self,
        most: int,
        clock: Callable[[], float],
        hear: Callable[[Guest], None],
        close: Callable[[Guest], None],
    ) -> None:
        self._files, self._most, self._warned = 0, most, False
        self._clock, self._hear, self._close = clock, hear, close
        self._addresses: _ByAddress = defaultdict(dict)
        self._shaking: _ByAddress = defaultdict(dict)  # TLS handshakes
        self._apart: dict[Guest, None] = {}  # WebSockets, which count for no address

    def everybody(self) -> list[Guest]:
        """Return all guests."""
        return [*self._apart, *(guest for crowd in self._addresses.values() for guest in crowd)]

    def enter(self, guest: Guest) -> None:
        """Add a new guest; close others if there are too many now."""
        address = guest.client[0]
        if len(self._addresses[address]) >= CONNECTIONS:
            self._make_room(self._addresses[address])
        if guest.kind == ENCRYPTED:
            if sum(map(len, self._shaking.values())) >= HANDSHAKES:
                self._make_room(_largest(self._shaking))
            self._shaking[address][guest] = None
        self._addresses[address][guest] = None
        self.take_file()

    def leave(self, guest: Guest) -> None:
        """Forget a guest that was closed."""
        self._apart.pop(guest, None)
        _leave(self._shaking, guest)
        _leave(self._addresses, guest)

    def has_spoken(self, guest: Guest) -> None:
        """Note that a guest's handshake is over."""
        _leave(self._shaking, guest)

    def set_apart(self, guest: Guest) -> None:
        """Stop counting a guest for its address, unless too many guests are apart already."""
        if len(self._apart) >= lasting_of(self._most):
            return
        self._apart[guest] = None
        _leave(self._addresses, guest)

    def take_file(self) -> None:
        """Count an opened file; above the limit, close connections of the busiest address."""
        self._files += 1
        while self._files > self._most and self.make_room():
            pass

    def give_file(self) -> None:
        """Count a closed file."""
        self._files -= 1

    def make_room(self, error: OSError | None = None) -> bool:
        """Close a connection of the busiest address, if ``error`` is a lack of files or None."""
        if error is not None and error.errno not in (errno.EMFILE, errno.ENFILE):
            return False
        if not self._warned:
            self._warned = True
            _LOG.warning(_FULL, self._most)
        return self._make_room(_largest(self._addresses))

    def _make_room(self, crowd: dict[Guest, None]) -> bool:
        """Close one connection of these guests.

        Silent connections that were never answered are closed first, then other silent connections,
        busy ones, and new ones.

        If more than half of the connections are new, somebody is flooding the server, and new ones
        are closed right after the silent ones that were never answered, the oldest first. A
        connection's bytes are read before it is closed, because they may contain a Stop. A
        connection whose Stop is being answered is closed last.
        """
        now = self._clock()
        new = [g for g in crowd if g.silent and not g.known and now - g.since < GRACE]
        flood = 2 * len(new) > len(crowd)

        def rank(guest: Guest) -> tuple[int, float]:
            if guest.stop:
                return 5, guest.since
            if not guest.silent:
                return 3, guest.since
            if guest.known:
                return 2, guest.since
            if now - guest.since < GRACE:
                return 1 if flood else 4, guest.since
            return 0, guest.since

        for _ in range(_READ):
            if not crowd:
                return False
            guest = min(crowd, key=rank)
            was = rank(guest)
            if guest.silent:
                self._hear(guest)
            if guest.closed:
                return True
            if rank(guest) <= was:
                break
        self._close(guest)
        return True


def _largest(addresses: _ByAddress) -> dict[Guest, None]:
    return max(addresses.values(), key=len, default={})


def _leave(addresses: _ByAddress, guest: Guest) -> None:
    crowd = addresses.get(guest.client[0], {})
    crowd.pop(guest, None)
    if not crowd:
        addresses.pop(guest.client[0], None)
