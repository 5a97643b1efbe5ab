"""Run the card's real firmware without a card, in virtual time, on a bus of emulated servos.

:class:`EmulatedCard` combines processor and bus behind a serial line: it takes the host's bytes and
returns the card's. :class:`miburi.emulation.body.EmulatedBody` is a whole body on such a card.

A small C library around libsimavr, ``firmware/emulator``, emulates the processor. ``make
firmware`` builds it. It is not part of this package, because its licence is the GPL.
"""

import ctypes
import os
from math import ceil, inf, nextafter
from pathlib import Path
from typing import Protocol

from miburi.emulation.bus import Bus
from miburi.errors import BodyError

#: The card's clock, Hz.
_CLOCK = 16_000_000
_CYCLES = _CLOCK // 1_000_000
#: The longest time, in µs, that the processor runs before the world around it is updated.
_SLICE = 2_000
_HOST, _BUS = 0, 1
_CRASHED = 2
EEPROM_SIZE = 4096


#: The program that an :class:`EmulatedCard` runs, and the library that runs it.
_PROGRAM, _PROCESSOR = "miburi.elf", "libmega.so"


def is_built() -> bool:
    """Return whether ``make firmware`` has built all that an :class:`EmulatedCard` needs."""
    return all((_firmware() / name).is_file() for name in (_PROGRAM, _PROCESSOR))


def firmware_file(name: str) -> Path:
    """Return the path of a file that ``make firmware`` has built, such as ``miburi.hex``.

    Raises
    ------
    BodyError
        The file does not exist.
    """
    path = _firmware() / name
    if not path.is_file():
        raise BodyError(
            f"{path} is not there. Run `make firmware` in a copy of Miburi's repository, "
            "or set MIBURI_FIRMWARE to the folder that holds this file."
        )
    return path


def _firmware() -> Path:
    return Path(os.environ.get("MIBURI_FIRMWARE", Path(__file__).parents[3] / "build/firmware"))


def _micros(seconds: float) -> float:
    """Convert a time to µs, rounded up; with a time rounded down, a wait might never end."""
    micros = seconds * 1e6
    return micros if micros / 1e6 >= seconds else nextafter(micros, inf)


class Mega:
    """An emulated Arduino Mega 2560 that runs an ELF file."""

    def __init__(self, elf: Path, library: Path) -> None:
        lib = self._lib = ctypes.CDLL(str(library))
        lib.mega_new.restype, lib.mega_cycle.restype = ctypes.c_void_p, ctypes.c_uint64
        for function in (lib.mega_run, lib.mega_input, lib.mega_output, lib.mega_baud):
            function.restype = ctypes.c_uint
        handle = lib.mega_new(str(elf).encode())
        if not handle:
            raise BodyError(f"{elf} cannot be run; build it again with `make firmware`.")
        self._mega = ctypes.c_void_p(handle)
        self._buffer = (ctypes.c_uint8 * 65536)()

    @property
    def time(self) -> float:
        """Time since power-on, µs."""
        return float(self._lib.mega_cycle(self._mega)) / _CYCLES

    def run(self, until: float) -> bool:
        """Run until a time (µs) or the end of a burst on the bus; return whether a burst ended."""
        result = self._lib.mega_run(self._mega, ctypes.c_uint64(ceil(until * _CYCLES)))
        if result == _CRASHED:
            raise BodyError("The emulated processor crashed; please report this.")
        return bool(result)

    def give(self, port: int, data: bytes, at: float = 0.0) -> None:
        """Send bytes to a serial port, the first not before ``at`` µs."""
        cycle = ctypes.c_uint64(round(at * _CYCLES))
        self._lib.mega_input(self._mega, port, data, len(data), cycle)

    def take(self, port: int) -> bytes:
        """Return the bytes that the card has sent on a serial port."""
        count = self._lib.mega_output(self._mega, port, self._buffer, len(self._buffer))
        return bytes(self._buffer[:count])

    def baud(self, port: int) -> int:
        """Return the speed of a serial port, in bits per second."""
        return int(self._lib.mega_baud(self._mega, port))

    def dropped(self, port: int) -> int:
        """Return the number of bytes that the card lost because it did not read them in time."""
        return int(self._lib.mega_dropped(self._mega, port))

    def reset(self) -> None:
        """Press the reset button."""
        self._lib.mega_reset(self._mega)

    def poke(self, address: int, data: bytes) -> None:
        """Write to the data memory."""
        for offset, byte in enumerate(data):
            self._lib.mega_poke(self._mega, address + offset, byte)

    def peek(self, address: int, count: int) -> bytes:
        """Read the data memory."""
        return bytes(self._lib.mega_peek(self._mega, address + at) for at in range(count))

    def jump(self, address: int) -> None:
        """Let the processor continue at an address of its program."""
        self._lib.mega_jump(self._mega, address)

    @property
    def eeprom(self) -> bytes:
        """The memory that survives a loss of power."""
        self._lib.mega_eeprom(self._mega, self._buffer, EEPROM_SIZE, 0)
        return bytes(self._buffer[:EEPROM_SIZE])

    @eeprom.setter
    def eeprom(self, data: bytes) -> None:
        copy = (ctypes.c_uint8 * len(data)).from_buffer_copy(data)
        self._lib.mega_eeprom(self._mega, copy, len(data), 1)

    def close(self) -> None:
        """Switch the processor off and free it."""
        if self._mega:
            self._lib.mega_free(self._mega)
            self._mega = ctypes.c_void_p()


class World(Protocol):
    """The simulated physics on which the servos act."""

    def advance(self, time: float) -> None:
        """Run the physics until ``time`` µs."""


class EmulatedCard:
    """Card, bus and servos, as one end of a serial line (see :class:`miburi.card.line.Line`).

    Parameters
    ----------
    bus
        The servos.
    world
        The physics that the servos move, if any.
    elf, library
        The program and the emulator; by default those that ``make firmware`` has built.
    """

    def __init__(
        self,
        bus: Bus,
        world: World | None = None,
        elf: Path | None = None,
        library: Path | None = None,
    ) -> None:
        self.mega = Mega(elf or firmware_file(_PROGRAM), library or firmware_file(_PROCESSOR))
        self.bus = bus
        self._world = world
        self._output = bytearray()

    def now(self) -> float:
        """Return the virtual time in s."""
        return self.mega.time / 1e6

    def run(self, until: float) -> None:
        """Run card, bus and physics until ``until`` µs."""
        now = self.mega.time
        while now < until:
            burst = self.mega.run(min(until, now + _SLICE))
            now = self.mega.time
            if self._world is not None:
                self._world.advance(now)
            if burst:
                for start, data in self.bus.answer(self.mega.take(_BUS), now, self.mega.baud(_BUS)):
                    self.mega.give(_BUS, data, start)
            self._output += self.mega.take(_HOST)

    def read(self, until: float) -> bytes:
        """Return bytes as soon as the card sends some, or no bytes if none came by ``until`` s."""
        end = _micros(until)
        while not self._output and self.mega.time < end:
            self.run(min(end, self.mega.time + _SLICE))
        data = bytes(self._output)
        self._output.clear()
        return data

    def write(self, data: bytes) -> None:
        """Send bytes to the card."""
        self.mega.give(_HOST, data)

    def wait(self, until: float) -> None:
        """Run card, bus and physics until ``until`` s."""
        self.run(_micros(until))

    def close(self) -> None:
        """Switch the card off."""
        self.mega.close()
