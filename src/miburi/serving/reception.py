"""The reception: holds all connections, answers Stop itself, and relays the rest to the server.

The server may be busy, or it may hang. So a separate process accepts connections, and reads the
head of each request over plain http. A Stop goes from here directly to the partner's process, not
via the server (:mod:`miburi.serving.lane`). Any other request is relayed to the server, and the
answer to the client (:mod:`miburi.serving.relay`); this process keeps the connection. So a Stop
never waits for the server, even over a connection that was kept open, and silent connections cost
the server nothing. If there are too many connections, the reception closes one
(:mod:`miburi.serving.crowd`).

Over https only the server can read a head, so a Stop waits there like any other request.

Windows cannot send open files to another process; there the server itself listens.
"""

import gc
import math
import re
import selectors
import socket
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from functools import partial
from multiprocessing.connection import Connection

from starlette.types import Receive, Scope, Send

from miburi.ground.cores import come_first
from miburi.serving.access import HEADER_TIME, HEADERS, STOP, Gate
from miburi.serving.crowd import Crowd
from miburi.serving.files import for_connections
from miburi.serving.keys import Keys
from miburi.serving.lane import Lane
from miburi.serving.passing import ENCRYPTED, PLAIN, Note, pass_on
from miburi.serving.relay import Guest, answer_of

#: How many connections are accepted, and how many are passed on, before other connections get a
#: turn, one of which may carry a Stop.
_AT_ONCE, _PASSED_AT_ONCE = 64, 16
_GLANCE = 0.25
_END = re.compile(rb"\n\r?\n")
_TOO_LARGE = f"the headers of a request may have {HEADERS} bytes at most."
_STOP = f"POST {STOP} ".encode()
_OVERTAKEN = "Stop has overtaken this request, which may not have been carried out."


def receive(
    plain: Sequence[socket.socket],
    encrypted: socket.socket | None,
    passage: socket.socket,
    stopping: Connection,
    keys: Keys | None,
    origins: frozenset[str],
) -> None:
    """Run the reception, in its own process, until the partner's process has ended."""
    come_first(apart=True)
    gate = Gate(_nobody, keys, https=encrypted is not None, origins=origins)
    reception = Reception(plain, encrypted, passage, stopping, gate, for_connections())
    gc.freeze()
    reception.serve()
    reception.close()


async def _nobody(scope: Scope, receive: Receive, send: Send) -> None:
    """Stand in for the application: only the gate's decisions are used."""


class Reception:
    """Accepts and handles connections.

    Parameters
    ----------
    plain, encrypted
        The non-blocking sockets that listen for http and https.
    passage
        The non-blocking Unix socket to the server.
    stopping
        The connection to the partner's process: see :class:`~miburi.serving.lane.Lane`.
    gate
        Decides who may stop the partner.
    most
        The largest number of open files. A connection takes one file, a relayed connection two.
    clock
        Returns the time in s, on the clock that all processes share.
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
        self._passage, self._clock = passage, clock
        self._crowd = Crowd(
            most, clock, lambda guest: self._hear(guest, selectors.EVENT_READ), self._close
        )
        self._lane = Lane(stopping, gate, self._answer, clock)
        self._waiting: deque[Guest] = deque()  # for the server
        self._full = False  # whether the server takes nothing now
        self._tidied = -math.inf
        self._over = False
        self._selector = selectors.DefaultSelector()
        for listener in plain:
            self._watch(listener, partial(self._accept, listener, PLAIN))
        if encrypted is not None:
            self._watch(encrypted, partial(self._accept, encrypted, ENCRYPTED))
        self._watch(passage, self._hear_passage)
        self._watch(stopping, lambda _events: self._hear_partner())

    def serve(self) -> None:
        """Serve until the partner's process ends."""
        while not self._over:
            self.turn(_GLANCE)

    def close(self) -> None:
        """Close all connections of this process."""
        for guest in self._crowd.everybody():
            self._close(guest)
        self._selector.close()

    def turn(self, patience: float = 0.0) -> None:
        """Wait up to ``patience`` s for events, and handle them."""
        hurries = bool(self._waiting) and not self._full
        for key, events in self._selector.select(0.0 if hurries else patience):
            key.data(events)
        self._pass_on()
        now = self._clock()
        if now - self._tidied >= _GLANCE:
            self._tidied = now
            self._tidy(now)

    def _watch(self, what: socket.socket | Connection, do: Callable[[int], None]) -> None:
        self._selector.register(what, selectors.EVENT_READ, do)

    def _attend(self, guest: Guest) -> None:
        """Register the events for which a connection and its relay wait next."""
        if guest.closed:
            return
        self._await(guest.line, guest.line_wants, partial(self._hear, guest))
        if guest.relay is not None:
            self._await(guest.relay, guest.relay_wants, partial(self._hear_server, guest))

    def _await(
        self, what: socket.socket, wants: tuple[bool, bool], do: Callable[[int], None]
    ) -> None:
        events = selectors.EVENT_READ * wants[0] | selectors.EVENT_WRITE * wants[1]
        key = self._selector.get_map().get(what)
        if key is not None and not events:
            self._selector.unregister(what)
        elif key is None and events:
            self._selector.register(what, events, do)
        elif key is not None and key.events != events:
            self._selector.modify(what, events, do)

    def _accept(self, listener: socket.socket, kind: bytes, _events: int) -> None:
        for _ in range(_AT_ONCE):
            try:
                line, address = listener.accept()
            except BlockingIOError:
                return
            except OSError as error:
                self._crowd.make_room(error)
                return  # no files are left, or the client has left
            line.setblocking(False)
            guest = Guest(line, (address[0], address[1]), kind, self._clock())
            self._crowd.enter(guest)
            # A request that has arrived already is handled at once.
            self._hear(guest, selectors.EVENT_READ)
            self._attend(guest)

    def _close(self, guest: Guest) -> None:
        if guest.closed:
            return
        for one in (guest.line, guest.relay):
            if one is not None:
                self._crowd.give_file()
                self._forget(one)
        guest.close()
        self._crowd.leave(guest)

    def _forget(self, what: socket.socket) -> None:
        with suppress(KeyError, ValueError):
            self._selector.unregister(what)

    def _hear(self, guest: Guest, events: int) -> None:
        """Read from a client, or send what is waiting for it."""
        if guest.closed:  # earlier in this turn
            return
        gone = events & selectors.EVENT_WRITE and not guest.flush()
        if not gone and events & selectors.EVENT_READ:
            gone = not (guest.forward() if guest.body else self._look(guest))
        self._go_on(guest, gone=bool(gone))

    def _hear_server(self, guest: Guest, events: int) -> None:
        """Read the server's response, or send the server more of the request."""
        relay = guest.relay
        if relay is None or guest.closed:
            return
        if events & selectors.EVENT_WRITE:
            guest.push()
        gone = False
        if events & selectors.EVENT_READ:
            guest.fetch()
            if guest.relay is None:
                self._crowd.give_file()
                self._forget(relay)
            gone = not guest.flush()
        self._go_on(guest, gone=gone)

    def _go_on(self, guest: Guest, *, gone: bool) -> None:
        """Close a finished connection, or register its next events."""
        if not guest.silent:
            self._crowd.has_spoken(guest)
        if gone or (guest.ends and guest.resting):
            self._close(guest)
            return
        if guest.resting and not guest.silent:
            guest.silent, guest.known, guest.since = True, True, self._clock()
        self._attend(guest)

    def _look(self, guest: Guest) -> bool:
        """Inspect a client's request; return False if the client has disconnected."""
        try:
            head = guest.line.recv(HEADERS, socket.MSG_PEEK)
        except BlockingIOError:
            return True
        except OSError:
            return False
        if len(head) == guest.seen:  # only the end has come
            return False
        guest.seen, new = 0, guest.relay is None and not guest.waits
        guest.line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVLOWAT, 1)
        if guest.kind == ENCRYPTED:
            self._wait(guest, 0)
            return True
        end = _END.search(head)
        may_be_stop = head.startswith(_STOP) or _STOP.startswith(head)
        if end is None and len(head) < HEADERS and (head[:1].isupper() if new else may_be_stop):
            guest.seen = len(head)  # look again after more bytes
            guest.line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVLOWAT, len(head) + 1)
        elif may_be_stop and end is not None and self._lane.lets_in(guest, head[: end.end()]):
            guest.stop, guest.silent, guest.since = end.end(), False, self._clock()
            guest.looked = True
            self._lane.stop(guest)
        elif not new:
            guest.looked = True  # it has its turn
        elif end is None and head[:1].isupper():
            guest.ends = True
            self._answer(guest, 431, _TOO_LARGE)
        else:
            guest.silent, guest.since = False, self._clock()
            self._wait(guest, 0 if end is None else end.end())
        return True

    def _wait(self, guest: Guest, head: int) -> None:
        guest.wait(head)
        self._waiting.append(guest)

    def _hear_partner(self) -> None:
        self._over = not self._lane.hear() or self._over

    def _answer(self, guest: Guest, status: int, words: str = "") -> None:
        if guest.closed:
            return
        stop, guest.stop = guest.stop, 0
        answer = b""
        if guest.waits or guest.relay is not None:  # the client did not wait for an earlier answer
            if guest.begun:
                return  # the server gets this Stop, too, and stops the body once more
            bare = guest.head.startswith(b"HEAD ")
            if guest.relay is not None:
                self._crowd.give_file()
                self._forget(guest.relay)
            guest.waits = False
            guest.drop()
            answer = answer_of(503, "" if bare else _OVERTAKEN, ends=False)
        if stop:
            with suppress(OSError):  # the client has gone
                guest.line.recv(stop)
        gone = not guest.tell(
            answer + answer_of(status, words, ends=guest.ends, origin=guest.origin)
        )
        self._go_on(guest, gone=gone)

    def _pass_on(self) -> None:
        """Pass a few waiting requests on to the server, as it accepts them."""
        for _ in range(_PASSED_AT_ONCE):
            while self._waiting and not self._waiting[0].waits:  # closed, or overtaken
                self._waiting.popleft()
            if self._full or not self._waiting:
                return
            guest = self._waiting[0]
            try:
                ours, theirs = socket.socketpair()
            except OSError:  # no files are left
                self._crowd.make_room()
                return
            here = guest.line.getsockname()
            note = Note(guest.kind, guest.since, guest.client, (here[0], here[1]))
            with theirs:
                self._full = not pass_on(self._passage, theirs.fileno(), note)
            if self._full:
                ours.close()
                with suppress(KeyError):  # the server has gone
                    events = selectors.EVENT_READ | selectors.EVENT_WRITE
                    self._selector.modify(self._passage, events, self._hear_passage)
                return
            self._waiting.popleft()
            guest.begin(ours)
            if guest.apart:
                self._crowd.set_apart(guest)
            self._crowd.take_file()
            self._attend(guest)

    def _hear_passage(self, events: int) -> None:
        """Handle the passage's events: the server accepts more, or has ended."""
        self._full = bool(events & selectors.EVENT_READ)
        if self._full:
            self._selector.unregister(self._passage)
        else:
            self._selector.modify(self._passage, selectors.EVENT_READ, self._hear_passage)

    def _tidy(self, now: float) -> None:
        """Send a heartbeat, answer Stops that waited too long, and close silent connections."""
        self._lane.tidy(now)
        for guest in self._crowd.everybody():
            if guest.silent and now - guest.since > HEADER_TIME:
                self._close(guest)
