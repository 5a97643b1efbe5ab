"""The reception: takes connections in, answers Stop itself, and passes the others to the server.

The server may be busy: with pages, with many who ask, with a step that takes long. So a process of
its own listens, and looks at the head of each request by plain http. A Stop goes from here to the
partner's process, past the server. A connection with any other request is passed to the server as
an open file, and comes back once it has been answered. So a Stop never waits for the server, over a
connection that is new or kept, and connections that say nothing cost the server nothing.

By https only who has the keys can read a head. Such a connection is passed on with its first bytes
and stays with the server; a Stop over it takes its turn there.

Windows passes no open files in this way; there the server listens itself.
"""

import errno
import gc
import json
import math
import re
import selectors
import socket
import time
from collections import defaultdict, deque
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from email.utils import formatdate
from functools import partial
from http import HTTPStatus
from multiprocessing.connection import Connection

import h11
from starlette.types import Receive, Scope, Send

from miburi.ground.cores import come_first
from miburi.interface.access import (
    CONNECTIONS,
    HEADER_TIME,
    HEADERS,
    SAFE_HEADERS,
    STOP,
    Gate,
    RefusedError,
)
from miburi.interface.passing import ENCRYPTED, PLAIN, pass_on, taken_in
from miburi.live.press import BY, By, outlasting, who

__all__ = ["BEAT", "SILENCE", "Reception", "receive"]

#: s between two signs of life, and s after which a Stop is said to have reached nobody (ours).
BEAT, SILENCE = 1.0, 1.0
#: Files of its process that are no connections.
_OWN_FILES = 64
_AT_ONCE = 64
_GLANCE = 0.25
_WISHES = {b"upgrade", b"expect"}
_END = re.compile(rb"\n\r?\n")
_TOO_LARGE = f"the headers of a request may have {HEADERS} bytes at most."
_NO_ANSWER = "the partner cannot be reached; should it answer again, it will stop."


def receive(
    plain: Sequence[socket.socket],
    encrypted: socket.socket | None,
    passage: socket.socket,
    stopping: Connection,
    token: str | None,
) -> None:
    """Receive until the partner's process has ended; for a process of its own.

    The parameters are those of :class:`Reception` and of its gate.
    """
    come_first(apart=True)
    import resource  # there is none on Windows, where nobody receives

    gate = Gate(_nobody, token, https=encrypted is not None)
    most = resource.getrlimit(resource.RLIMIT_NOFILE)[0] - _OWN_FILES
    reception = Reception(plain, encrypted, passage, stopping, gate, most)
    gc.freeze()
    reception.serve()
    reception.close()


async def _nobody(scope: Scope, receive: Receive, send: Send) -> None:
    """Stand behind a gate that is only asked."""


@dataclass(eq=False)
class _Guest:
    """An open connection: silent until a request's head has come, known once it was answered."""

    line: socket.socket
    address: str
    kind: bytes
    since: float
    known: bool
    silent: bool = True
    ends: bool = False


class Reception:
    """Sees to the listening sockets.

    Parameters
    ----------
    plain, encrypted
        The sockets that listen by http and by https; they never block.
    passage
        Leads to the server; a Unix socket that never blocks.
    stopping
        Leads to the partner's process: takes a Stop's time and who pressed, or None as a sign of
        life, and answers each with None when it is done.
    gate
        Says who may stop the partner.
    most
        Connections that may be open here.
    clock
        Gives s, the same in all processes.
    """

    def __init__(
        self,
        plain: Iterable[socket.socket],
        encrypted: socket.socket | None,
        passage: socket.socket,
        stopping: Connection,
        gate: Gate,
        most: int,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._passage, self._stopping, self._gate, self._clock = passage, stopping, gate, clock
        self._crowds: defaultdict[str, dict[_Guest, None]] = defaultdict(dict)
        self._guests = 0
        self._most = most
        self._passing: deque[_Guest] = deque()
        self._pressing: list[_Guest] = []
        self._by: By | None = None  # who pressed since the last Stop was sent
        self._pressed: list[_Guest] = []
        self._wanted = self._asked = False
        self._told = self._tidied = -math.inf  # the first sign of life is due
        self._over = False
        self._selector = selectors.DefaultSelector()
        for listener in plain:
            self._watch(listener, partial(self._accept, listener, PLAIN))
        if encrypted is not None:
            self._watch(encrypted, partial(self._accept, encrypted, ENCRYPTED))
        self._watch(passage, self._take_back)
        self._watch(stopping, self._hear_partner)

    def serve(self) -> None:
        """Serve until the partner's process has gone."""
        while not self._over:
            self.turn(_GLANCE)

    def close(self) -> None:
        """Close all connections that are here."""
        for guest in [*self._everybody(), *self._passing]:
            self._close(guest)
        self._selector.close()

    def turn(self, patience: float = 0.0) -> None:
        """Do what there is to do, and wait for it so many s at most."""
        for key, _ in self._selector.select(patience):
            key.data()
        now = self._clock()
        if now - self._tidied >= _GLANCE:
            self._tidied = now
            self._tidy(now)

    def _watch(self, what: socket.socket | Connection, do: Callable[[], None]) -> None:
        self._selector.register(what, selectors.EVENT_READ, do)

    def _accept(self, listener: socket.socket, kind: bytes) -> None:
        for _ in range(_AT_ONCE):
            try:
                line, address = listener.accept()
            except BlockingIOError:
                return
            except OSError as error:
                if error.errno in (errno.EMFILE, errno.ENFILE):
                    self._make_room(self._everybody())
                return  # else it has gone again
            self._welcome(line, address[0], kind, known=False)

    def _welcome(self, line: socket.socket, address: str, kind: bytes, *, known: bool) -> None:
        line.setblocking(False)
        crowd = self._crowds[address]
        # Never the new one gives way: it may be a Stop.
        if len(crowd) >= CONNECTIONS:
            self._make_room(crowd)
        if self._guests >= self._most:
            self._make_room(self._everybody())
        guest = _Guest(line, address, kind, self._clock(), known)
        self._crowds[address][guest] = None
        self._guests += 1
        self._watch(line, partial(self._listen, guest))

    def _everybody(self) -> list[_Guest]:
        guests = (guest for crowd in self._crowds.values() for guest in crowd)
        return sorted(guests, key=lambda guest: guest.since)

    def _make_room(self, guests: Iterable[_Guest]) -> None:
        """Close the oldest silent stranger; else the oldest silent guest; else the oldest."""
        guests = list(guests)
        for known in (False, True):
            for guest in guests:
                if guest.silent and guest.known <= known:
                    self._close(guest)
                    return
        if guests:
            self._close(guests[0])

    def _close(self, guest: _Guest) -> None:
        self._let_go(guest)
        guest.line.close()

    def _let_go(self, guest: _Guest) -> None:
        """Count a connection no more."""
        self._ignore(guest)
        crowd = self._crowds[guest.address]
        if guest in crowd:
            del crowd[guest]
            self._guests -= 1
        if not crowd:
            del self._crowds[guest.address]

    def _ignore(self, guest: _Guest) -> None:
        with suppress(KeyError, ValueError):
            self._selector.unregister(guest.line)

    def _listen(self, guest: _Guest) -> None:
        """Look at what a connection brings, and leave it there for the server."""
        try:
            head = guest.line.recv(HEADERS, socket.MSG_PEEK)
        except BlockingIOError:
            return
        except OSError:
            head = b""
        if not head:
            self._close(guest)
            return
        end = _END.search(head)
        if guest.kind == PLAIN and head[:1].isupper() and end is None:
            if len(head) >= HEADERS:
                guest.ends = True
                self._answer(guest, 431, _TOO_LARGE)
            else:  # look again when more has come
                guest.line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVLOWAT, len(head) + 1)
            return
        guest.silent, guest.since = False, self._clock()
        self._ignore(guest)
        guest.line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVLOWAT, 1)
        if guest.kind == PLAIN and end is not None and self._may_stop(guest, head[: end.end()]):
            guest.line.recv(end.end())
            self._pressing.append(guest)
            self._wanted = True
            self._press()
        else:
            self._passing.append(guest)
            self._pass_on()

    def _may_stop(self, guest: _Guest, head: bytes) -> bool:
        """Whether this is a Stop that the gate lets in; the server answers whatever is not."""
        if not head.startswith(f"POST {STOP} ".encode()):
            return False
        reader = h11.Connection(h11.SERVER, HEADERS)
        try:
            reader.receive_data(head)
            request, end = reader.next_event(), reader.next_event()
        except h11.RemoteProtocolError:
            return False
        if not isinstance(request, h11.Request) or not isinstance(end, h11.EndOfMessage):
            return False  # it brings a body
        headers = [*request.headers]
        if request.http_version != b"1.1" or not _WISHES.isdisjoint(dict(headers)):
            return False  # whoever asks for more than to stop is the server's guest
        guest.ends = reader.their_state is h11.MUST_CLOSE
        by = who(dict(headers).get(BY.encode(), b"").decode("latin-1"))
        try:
            self._gate.check(
                {
                    "type": "http",
                    "scheme": "http",
                    "method": "POST",
                    "path": STOP,
                    "headers": headers,
                    "client": (guest.address, 0),
                    "server": guest.line.getsockname(),
                }
            )
        except (RefusedError, OSError):
            return False
        self._by = outlasting(self._by, by)
        return True

    def _press(self) -> None:
        """Send a Stop; one at a time, and who asks meanwhile shares the next."""
        if self._wanted and not self._asked:
            self._pressed, self._pressing, self._wanted = self._pressing, [], False
            by, self._by = self._by or "person", None
            self._tell((self._clock(), by))

    def _tell(self, what: tuple[float, By] | None) -> None:
        self._asked, self._told = True, self._clock()
        with suppress(OSError):  # its end comes to be heard
            self._stopping.send(what)

    def _hear_partner(self) -> None:
        try:
            self._stopping.recv()
        except (OSError, EOFError):
            self._over = True
            return
        pressed, self._pressed, self._asked = self._pressed, [], False
        for guest in pressed:
            self._answer(guest, 204)
        self._press()

    def _answer(self, guest: _Guest, status: int, words: str = "") -> None:
        """Answer, and listen for what comes next."""
        body = json.dumps({"detail": words}).encode() if words else b""
        lines = [f"HTTP/1.1 {status} {HTTPStatus(status).phrase}".encode()]
        headers = [(b"date", formatdate(usegmt=True).encode()), *SAFE_HEADERS]
        if body:
            headers += [
                (b"content-type", b"application/json"),
                (b"content-length", b"%d" % len(body)),
            ]
        if guest.ends:
            headers.append((b"connection", b"close"))
        lines += [name + b": " + value for name, value in headers]
        try:
            guest.line.send(b"\r\n".join([*lines, b"", body]))
        except OSError:
            guest.ends = True
        if guest.ends:
            self._close(guest)
        elif guest in self._crowds[guest.address]:
            guest.silent, guest.known, guest.since = True, True, self._clock()
            self._watch(guest.line, partial(self._listen, guest))

    def _pass_on(self) -> None:
        """Pass to the server what it takes; the rest waits until it takes more."""
        while self._passing:
            guest = self._passing[0]
            if guest.line.fileno() >= 0 and not pass_on(
                self._passage, guest.line.fileno(), guest.kind, guest.since
            ):
                break
            self._passing.popleft()
            self._close(guest)
        wanted = selectors.EVENT_READ | (selectors.EVENT_WRITE if self._passing else 0)
        with suppress(KeyError):  # the server has gone
            self._selector.modify(self._passage, wanted, self._take_back)

    def _take_back(self) -> None:
        """Take connections back that the server has answered."""
        for back in taken_in(self._passage, _AT_ONCE):
            if back is None:
                self._selector.unregister(self._passage)
                return
            try:
                address = back.line.getpeername()[0]
            except OSError:  # it has gone
                back.line.close()
                continue
            self._welcome(back.line, address, back.kind, known=True)
        self._pass_on()

    def _tidy(self, now: float) -> None:
        """Give a sign of life, and close what has been silent or waiting for too long."""
        if not self._asked and now - self._told >= BEAT:
            self._tell(None)
        for waiting in (self._pressed, self._pressing):
            while waiting and now - waiting[0].since > SILENCE:
                self._answer(waiting.pop(0), 503, _NO_ANSWER)
        for guest in self._everybody():
            if guest.silent and now - guest.since > HEADER_TIME:
                self._close(guest)
