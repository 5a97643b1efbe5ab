"""Serial lines: they carry bytes between host and card, and tell the host the time.

:class:`Line` is the interface, :class:`SerialLine` a real port; the emulated card is a line, too.
"""

import errno
import os
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


class SamePort:
    """Opens a serial port again and again, even if its USB device has another name after a replug.

    A device is known by its maker, kind and serial number; without that number, only ``port``, the
    name, is tried.
    """

    def __init__(self, port: str) -> None:
        self._port = port
        self._device: tuple[int, int, str] | None = None

    def __call__(self) -> SerialLine:
        """Open the port; raise OSError if that is impossible."""
        from serial.tools.list_ports import comports

        devices = {
            one.device: (one.vid, one.pid, one.serial_number)
            for one in comports()
            if one.serial_number
        }
        names = [name for name, device in devices.items() if device == self._device]
        linked = os.path.realpath(self._port)  # such as /dev/serial/by-id/…
        if not names or linked in names or self._port in names:
            names = [self._port, linked]
        line = SerialLine(names[0])
        self._device = next((devices[name] for name in names if name in devices), self._device)
        return line


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
