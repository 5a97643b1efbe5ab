"""Serial lines: they carry bytes between host and card, and tell the host the time.

:class:`Line` is the interface, :class:`SerialLine` a real port; the emulated card is a line, too.
"""

import errno
from time import monotonic, sleep
from typing import Protocol

BAUD = 115_200


class Line(Protocol):
    """A serial line to a card; reading or writing raises OSError when it is broken."""

    def now(self) -> float:
        """Return the time in s, on the line's clock."""

    def read(self, until: float) -> bytes:
        """Return bytes as soon as some arrive, or none at ``until``."""

    def write(self, data: bytes) -> None:
        """Send bytes."""

    def wait(self, until: float) -> None:
        """Wait until ``until``, even on a broken line."""

    def close(self) -> None:
        """Close the line."""


class SerialLine:
    """A serial port as a :class:`Line`; its clock is the computer's."""

    def __init__(self, port: str) -> None:
        import serial

        # exclusive: two programs must not command one robot.
        try:
            self._port = serial.Serial(port, BAUD, timeout=0, write_timeout=1, exclusive=True)
        except OSError as error:
            raise OSError(error.errno, _in_words(port, error)) from error
        except ValueError as error:
            raise OSError(f"{port!r} is not the name of a port") from error

    def now(self) -> float:
        """Return the time in s."""
        return monotonic()

    def read(self, until: float) -> bytes:
        """Return bytes as soon as some arrive; see :meth:`Line.read`."""
        self._port.timeout = max(until - monotonic(), 0.0)
        first = self._port.read(1)
        return bytes(first + self._port.read(self._port.in_waiting)) if first else b""

    def write(self, data: bytes) -> None:
        """Send bytes."""
        self._port.write(data)

    def wait(self, until: float) -> None:
        """Sleep until ``until``."""
        sleep(max(until - monotonic(), 0.0))

    def close(self) -> None:
        """Close the port."""
        self._port.close()


def _in_words(port: str, error: OSError) -> str:
    match error.errno:
        case errno.ENOENT:
            return f"there is no port {port}; `miburi card list` names the ports that exist"
        case errno.EACCES | errno.EPERM:
            return (
                f"you are not allowed to use {port}; on Debian or Ubuntu, run "
                "`sudo adduser $USER dialout`, then log out and in again"
            )
        case errno.EAGAIN | errno.EBUSY:
            return f"another program has {port} open; quit it"
        case _:
            return f"{port} cannot be used as a serial port ({error})"
