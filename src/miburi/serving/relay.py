"""A guest of the reception: one open connection, and how it is relayed to the server.

The connection never leaves the reception, so that a Stop on it can always be read. For each request
the server gets one end of a pair of Unix sockets, answers there, and closes it::

    client ══ line ══ Guest ══ relay ══ server

Up to 64 KiB of a response are held back until the server has closed its side. So once a client has
its response, the relay has ended, and the client's next request is read here. If a request lasts (a
stream of events), or its end cannot be seen from here (https, WebSockets, bodies in chunks), its
connection is relayed as raw bytes until either side closes.
"""

import json
import math
import socket
from contextlib import suppress
from dataclasses import dataclass, field
from email.utils import formatdate
from http import HTTPStatus
from typing import NamedTuple

import h11

from miburi.serving.access import EVENTS, HEADERS, SAFE_HEADERS
from miburi.serving.origins import cors
from miburi.serving.passing import ENCRYPTED

#: How many bytes are read at once, and how many of a response are held back (our choice).
_PIECE = 65_536
_WISHES = {b"upgrade", b"expect", b"transfer-encoding"}

Address = tuple[str, int]


class Framing(NamedTuple):
    """How a request ends.

    ``body`` is the size of the request's body in bytes, or infinity if it is unknown. ``ends``
    tells whether the connection is closed after this request. ``lasts`` is true for a WebSocket or
    a stream of events.
    """

    body: float
    ends: bool
    lasts: bool = False


def frame(head: bytes) -> Framing:
    """Return how the request with this head ends."""
    reader = h11.Connection(h11.SERVER, HEADERS)
    try:
        reader.receive_data(head)
        request = reader.next_event()
    except h11.RemoteProtocolError:
        request = None  # the server answers it
    if not isinstance(request, h11.Request):
        return Framing(math.inf, ends=True)
    headers = dict(request.headers)
    if not _WISHES.isdisjoint(headers):
        return Framing(math.inf, ends=True, lasts=b"upgrade" in headers)
    if request.target.partition(b"?")[0] == EVENTS.encode():
        return Framing(math.inf, ends=True, lasts=True)
    ends = request.http_version != b"1.1" or b"close" in headers.get(b"connection", b"").lower()
    return Framing(int(headers.get(b"content-length", b"0")), ends)


@dataclass(eq=False)
class Guest:
    """An open connection."""

    line: socket.socket  # the client's, which never blocks
    client: Address
    kind: bytes  # what the client speaks
    since: float  # when it opened, or last began or ended a request, in s
    #: Whether the head of a request or, over https, the end of the handshake is still to come.
    silent: bool = True
    known: bool = False  # whether it was answered before
    stop: int = 0  # bytes of a Stop that has not been answered, and is still in the socket
    ends: bool = False  # whether the connection will be closed after the response
    origin: str | None = None  # the cross-site origin of a Stop, if it may press Stop
    apart: bool = False  # a WebSocket or a stream of events, which the gate counts
    seen: int = 0  # bytes of a head that has not ended yet
    head: bytes = b""  # bytes of a request that waits for the server
    waits: bool = False  # whether a request waits for the server
    relay: socket.socket | None = None
    begun: bool = False  # whether a part of the present answer has been sent
    body: float = 0.0  # bytes of the request still to come
    looked: bool = False  # whether the bytes after the request have been inspected
    _back: bytearray = field(default_factory=bytearray)  # for the server
    _held: bytearray = field(default_factory=bytearray)  # of the answer
    _out: bytearray = field(default_factory=bytearray)  # for the client

    @property
    def closed(self) -> bool:
        """Whether the connection is closed."""
        return self.line.fileno() < 0

    @property
    def resting(self) -> bool:
        """Whether the client has all its answers."""
        return self.relay is None and not (self._out or self.stop or self.body or self.waits)

    @property
    def line_wants(self) -> tuple[bool, bool]:
        """Whether to read from the client now, and whether to write to it."""
        if self.waits:  # requests with these methods have no body
            more = self.head.startswith((b"GET ", b"HEAD ")) and not self.looked
        elif self.body:
            more = not self._back
        else:
            more = self.resting or (self.relay is not None and not self.looked)
        return more, bool(self._out)

    @property
    def relay_wants(self) -> tuple[bool, bool]:
        """Whether to read from the server now, and whether to write to it."""
        return not self._out, bool(self._back)

    def wait(self, head: int) -> None:
        """Keep a request's head for the server; ``head`` is its size in bytes, 0 if unreadable."""
        self.head = (_receive(self.line, head) if head else None) or b""
        self.waits, self.looked, self.begun = True, False, False

    def begin(self, relay: socket.socket) -> None:
        """Start to relay the waiting request."""
        relay.setblocking(False)
        framing = frame(self.head) if self.head else Framing(math.inf, ends=True)
        self.relay, self.waits, self.apart = relay, False, framing.lasts
        self.body, self.ends = framing.body, framing.ends
        self._back += self.head
        self.push()

    def close(self) -> None:
        """Close the connection, and the relay to the server."""
        self.line.close()
        self.waits = False
        self.drop()

    def drop(self) -> None:
        """Close the relay to the server, and discard the rest of the request."""
        if self.relay is not None:
            self.relay.close()
            self.relay = None
        if math.isinf(self.body):  # no other request can follow
            self.ends, self.body = True, 0.0
        self._back.clear()
        self._held.clear()
        self.begun = False

    def forward(self) -> bool:
        """Receive more of a request; return False if the client has disconnected."""
        if (piece := _receive(self.line, int(min(self.body, _PIECE)))) is None:
            return True
        if self.kind == ENCRYPTED and self.begun:
            self.silent = False
        self.body -= len(piece)
        self._back += piece
        self.push()
        return bool(piece)

    def push(self) -> None:
        """Send the server as many waiting bytes as its socket accepts."""
        if self.relay is None or not _send(self.relay, self._back):
            self._back.clear()  # it has answered already

    def fetch(self) -> None:
        """Receive more of an answer; at its end, close the relay."""
        while self.relay is not None and not self._out:
            if (piece := _receive(self.relay, _PIECE)) is None:
                return
            if not piece:
                self.ends |= not (self.begun or self._held)  # the server has ended
                self._out += self._held
                self.drop()
                return
            if math.isinf(self.body):
                self._out += piece
            elif len(self._held) + len(piece) > _PIECE:
                self._out, self._held = self._held, bytearray(piece)
            else:
                self._held += piece
            self.begun |= bool(self._out)
            if not self.flush():
                self.ends = True
                self.drop()

    def tell(self, answer: bytes) -> bool:
        """Send the reception's own answer; return False if the client has disconnected."""
        self._out += answer
        return self.flush()

    def flush(self) -> bool:
        """Send the client what its socket accepts; return False if it has disconnected."""
        return _send(self.line, self._out)


def _receive(line: socket.socket, most: int) -> bytes | None:
    """Return received bytes, b"" at the end of the connection, or None if there are none yet."""
    try:
        return line.recv(most)
    except BlockingIOError:
        return None
    except OSError:
        return b""


def _send(line: socket.socket, waiting: bytearray) -> bool:
    """Send as many waiting bytes as the other side accepts; return False if it has disconnected."""
    with suppress(BlockingIOError):
        try:
            while waiting:
                del waiting[: line.send(waiting)]
        except BlockingIOError:
            raise
        except OSError:
            return False
    return True


def answer_of(status: int, words: str, *, ends: bool, origin: str | None = None) -> bytes:
    """Return the bytes of the reception's own answer."""
    body = json.dumps({"detail": words}).encode() if words else b""
    headers = [(b"date", formatdate(usegmt=True).encode()), *SAFE_HEADERS]
    if origin is not None:
        headers += cors(origin)
    if status != HTTPStatus.NO_CONTENT:
        headers.append((b"content-length", b"%d" % len(body)))
    if body:
        headers.append((b"content-type", b"application/json"))
    if ends:
        headers.append((b"connection", b"close"))
    lines = [f"HTTP/1.1 {status} {HTTPStatus(status).phrase}".encode()]
    lines += [name + b": " + value for name, value in headers]
    return b"\r\n".join([*lines, b"", body])
