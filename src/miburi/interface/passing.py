"""Pass open connections from one process to another, over a Unix socket that never blocks."""

import errno
import os
import socket
import struct
from collections.abc import Iterator
from typing import NamedTuple

__all__ = ["CAN_PASS", "ENCRYPTED", "PLAIN", "Passed", "pass_on", "taken_in"]

#: Whether this system passes open files; Windows does not.
CAN_PASS = hasattr(socket, "send_fds")
#: What a connection speaks: http, or https.
PLAIN, ENCRYPTED = b"p", b"e"
#: The other side takes nothing at the moment: its socket, or the kernel, has enough.
_FULL = (errno.EAGAIN, errno.EWOULDBLOCK, errno.ENOBUFS, errno.ETOOMANYREFS)


_NOTE = struct.Struct("=cd")


class Passed(NamedTuple):
    """A connection that was passed: what it speaks, and when its request had come, s."""

    line: socket.socket
    kind: bytes
    came: float


def pass_on(passage: socket.socket, line: int, kind: bytes, came: float = 0.0) -> bool:
    """Pass a copy of an open file; False if the other side takes none now."""
    try:
        socket.send_fds(passage, [_NOTE.pack(kind, came)], [line])
    except OSError as error:
        if error.errno in (errno.EPIPE, errno.ECONNRESET) or error.errno in _FULL:
            return False
        raise
    return True


def taken_in(passage: socket.socket, most: int) -> Iterator[Passed | None]:
    """Yield the connections that wait in a passage, so many at most; None if its end has come."""
    for _ in range(most):
        try:
            note, lines, _, _ = socket.recv_fds(passage, _NOTE.size, 1)
        except BlockingIOError:
            return
        except OSError:
            note, lines = b"", []
        if not note:
            yield None
            return
        for line in lines:
            try:
                taken = socket.socket(fileno=line)
            except OSError:
                os.close(line)
            else:
                taken.setblocking(False)
                yield Passed(taken, *_NOTE.unpack(note))
