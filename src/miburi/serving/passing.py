"""Pass open connections between processes, over a non-blocking Unix socket."""

import errno
import json
import os
import socket
from collections.abc import Iterator
from typing import NamedTuple

#: Whether the system can send open files between processes; Windows cannot.
CAN_PASS = hasattr(socket, "send_fds")
#: A connection's protocol: http, or https.
PLAIN, ENCRYPTED = b"p", b"e"
#: Sending fails with one of these errors if the receiver's or the kernel's buffer is full.
_FULL = (errno.EAGAIN, errno.EWOULDBLOCK, errno.ENOBUFS, errno.ETOOMANYREFS)
#: Every note is padded to this many bytes; an IPv6 address with its zone takes at most 62 bytes.
_SIZE = 256


class Note(NamedTuple):
    """A connection's protocol, the time in s when its request arrived, and both its addresses."""

    kind: bytes
    came: float
    client: tuple[str, int]
    server: tuple[str, int]


class Passed(NamedTuple):
    """A connection that was passed."""

    line: socket.socket
    note: Note


def pass_on(passage: socket.socket, line: int, note: Note) -> bool:
    """Send a copy of an open file; return False if the receiver cannot take it now."""
    words = json.dumps([note.kind.decode(), *note[1:]]).encode()
    try:
        socket.send_fds(passage, [words.ljust(_SIZE)], [line])
    except OSError as error:
        if error.errno in (errno.EPIPE, errno.ECONNRESET) or error.errno in _FULL:
            return False
        raise
    return True


def taken_in(passage: socket.socket, most: int) -> Iterator[Passed | None]:
    """Yield up to ``most`` connections that wait in a socket.

    Yield None once the other end of the socket is closed.
    """
    for _ in range(most):
        try:
            words, lines, _, _ = socket.recv_fds(passage, _SIZE, 1)
        except BlockingIOError:
            return
        except OSError:
            words, lines = b"", []
        if not words:
            yield None
            return
        for line in lines:
            try:
                taken = socket.socket(fileno=line)
            except OSError:
                os.close(line)
            else:
                taken.setblocking(False)
                kind, came, client, server = json.loads(words)
                yield Passed(taken, Note(kind.encode(), came, tuple(client), tuple(server)))
