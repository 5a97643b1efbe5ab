"""Serial lines to a card: what carries bytes, and tells the time."""

import errno
from time import monotonic, sleep
from typing import Protocol

__all__ = ["BAUD", "Line", "SerialLine"]

BAUD = 115_200


class Line(Protocol):
    """A serial line to a card; it raises OSError when it is broken."""

    def now(self) -> float:
        """Return the time in s, on the line's clock."""

    def read(self, until: float) -> bytes:
        """Return what has come, as soon as something has, or nothing at the time ``until``."""

    def write(self, data: bytes) -> None:
        """Send."""

    def wait(self, until: float) -> None:
        """Let time pass until ``until``, even on a broken line."""

    def close(self) -> None:
        """Let go of the line."""


class SerialLine:
    """A serial port as a :class:`Line`; its clock is the computer's."""

    def __init__(self, port: str) -> None:
        import serial

        # exclusive: two programs that command one robot would be one too many.
        try:
            self._port = serial.Serial(port, BAUD, timeout=0, write_timeout=1, exclusive=True)
        except OSError as error:
            raise OSError(error.errno, _in_words(port, error)) from error
        except ValueError as error:
            raise OSError(f"{port!r} is no name of a port") from error

    def now(self) -> float:
        """Return the time in s."""
        return monotonic()

    def read(self, until: float) -> bytes:
        """Return what has come; see :class:`Line`."""
        self._port.timeout = max(until - monotonic(), 0.0)
        first = self._port.read(1)
        return bytes(first + self._port.read(self._port.in_waiting)) if first else b""

    def write(self, data: bytes) -> None:
        """Send."""
        self._port.write(data)

    def wait(self, until: float) -> None:
        """Sleep until then."""
        sleep(max(until - monotonic(), 0.0))

    def close(self) -> None:
        """Let go of the port."""
        self._port.close()


def _in_words(port: str, error: OSError) -> str:
    match error.errno:
        case errno.ENOENT:
            return f"there is no port {port}; `miburi card list` names those that are there"
        case errno.EACCES | errno.EPERM:
            return (
                f"you are not allowed to use {port}; on Debian and its kin, run "
                "`sudo adduser $USER dialout`, then log out and in again"
            )
        case errno.EAGAIN | errno.EBUSY:
            return f"another program uses {port}; close it first"
        case _:
            return f"{port} is no serial port that can be used ({error})"
