"""The link between host and card: bytes to frames, frames to bytes, and the report's payload.

A frame is COBS(version | kind | sequence | payload | CRC-16) and a zero byte; numbers are
little-endian. ``firmware/miburi/link.h`` is its counterpart on the card.
"""

import struct
from dataclasses import dataclass
from enum import IntEnum

from miburi.errors import MiburiError

VERSION = 8
#: The kind of an answer is the kind of its request plus this.
ANSWER = 0x80
_MAX_FRAME = 128


class FrameKind(IntEnum):
    """What a frame is about."""

    HELLO = 1
    SETTINGS = 2
    JOINT = 3
    READ = 4
    SAVE = 5
    MOVE = 6
    STOP = 7
    RELEASE = 8
    STATUS = 9
    RELAX = 10
    IDENTIFY = 11
    LOADS = 12
    PEEK = 13
    REPORT = 0x40
    REFUSED = 0x7F


class Result(IntEnum):
    """How the card answers a request."""

    OK = 0
    DAMAGED = 1
    VERSION = 2
    UNKNOWN = 3
    LENGTH = 4
    RANGE = 5
    PHASE = 6
    SERVO = 7
    SETTINGS = 8
    LOADS = 9


class Reason(IntEnum):
    """Why the card stopped, or why it refuses a release."""

    NONE = 0
    STARTED = 1
    ASKED = 2
    CONTACT = 3
    SILENT = 4
    DEAF = 5
    FAULTY = 6
    HOT = 7
    LOW_VOLTAGE = 8
    ASTRAY = 9
    MISNAMED = 10
    RESTARTED = 11
    OUTSIDE = 12
    ALONE = 13
    TOUCHED = 14


class FrameError(MiburiError):
    """The bytes are not a valid frame; the link skips them."""


@dataclass(frozen=True)
class Frame:
    """One message.

    Attributes
    ----------
    kind
        The kind of message, a :class:`FrameKind`.
    sequence
        A number from 0 to 255; an answer repeats the number of its request.
    payload
        At most 96 bytes.
    version
        The link's version; never 0, because a frame of zeros would have a valid checksum.
    """

    kind: int
    sequence: int
    payload: bytes = b""
    version: int = VERSION


def crc16(data: bytes) -> int:
    """Return the CRC-16 of DYNAMIXEL's protocol 2.0: polynomial 0x8005, starting at 0."""
    crc = 0
    for byte in data:
        crc = (crc << 8 & 0xFFFF) ^ _CRC_TABLE[crc >> 8 ^ byte]
    return crc


def _crc_of_byte(byte: int) -> int:
    crc = byte << 8
    for _ in range(8):
        crc = (crc << 1 ^ (0x8005 if crc & 0x8000 else 0)) & 0xFFFF
    return crc


_CRC_TABLE = [_crc_of_byte(byte) for byte in range(256)]


def encode(frame: Frame) -> bytes:
    """Return the bytes of a frame, with the delimiter."""
    body = bytes((frame.version, frame.kind, frame.sequence)) + frame.payload
    body += struct.pack("<H", crc16(body))
    # This is all of COBS for a frame shorter than 254 bytes.
    blocks = body.split(b"\0")
    return b"".join(bytes((len(block) + 1,)) + block for block in blocks) + b"\0"


def decode(data: bytes) -> Frame:
    """Return the frame in ``data``, which has no delimiter.

    Raises
    ------
    FrameError
        The bytes are not a complete, undamaged frame.
    """
    blocks, at = [], 0
    while at < len(data):
        end = at + data[at]
        if data[at] == 0 or end > len(data):
            raise FrameError("the frame's blocks do not add up")
        blocks.append(data[at + 1 : end])
        at = end
    body = b"\0".join(blocks)
    if len(body) < 5 or struct.unpack("<H", body[-2:])[0] != crc16(body[:-2]):
        raise FrameError("the frame's checksum is wrong")
    if body[0] == 0:
        raise FrameError("there is no version 0 of the link")
    return Frame(body[1], body[2], body[3:-2], version=body[0])


class Receiver:
    """Turn a stream of bytes into frames, and skip damaged ones.

    Attributes
    ----------
    damaged
        How many damaged pieces were skipped.
    """

    def __init__(self) -> None:
        self._bytes = bytearray()
        self.damaged = 0

    def add(self, data: bytes) -> list[Frame]:
        """Add bytes from the stream; return the frames that they complete."""
        self._bytes += data
        *pieces, rest = self._bytes.split(b"\0")
        self._bytes = rest[-_MAX_FRAME:]
        frames = []
        for piece in pieces:
            if not piece:
                continue
            try:
                frames.append(decode(bytes(piece)))
            except FrameError:
                self.damaged += 1
        return frames


_REPORT = struct.Struct("<q4B2i2q2B8h8h16B")


@dataclass(frozen=True)
class Report:
    """The card's status, in the card's units: µs, steps, steps/s, 1/256 steps, °C, 0.1 V.

    Attributes
    ----------
    measured, expected, length
        At a contact, the actual and the expected travel that the rule compared, and how long it
        took.
    heard
        A bit for each motor that answered the latest reading.
    held, limp
        Whether the servos have confirmed that they hold their positions, and whether their torque
        is off.
    """

    time: int
    phase: int
    reason: int
    motor: int
    sign: int
    measured: int
    expected: int
    length: int
    stop_time: int
    heard: int
    held: bool
    limp: bool
    positions: tuple[int, ...]
    speeds: tuple[int, ...]
    temperatures: tuple[int, ...]
    voltages: tuple[int, ...]

    @classmethod
    def of(cls, payload: bytes) -> "Report":
        """Read the payload of a report.

        Raises
        ------
        FrameError
            The length is wrong.
        """
        if len(payload) != _REPORT.size:
            raise FrameError(f"a report has {_REPORT.size} bytes, got {len(payload)}")
        values = _REPORT.unpack(payload)
        flags, positions, speeds = values[10], values[11:19], values[19:27]
        lists = positions, speeds, values[27::2], values[28::2]
        return cls(*(*values[:10], bool(flags & 1), bool(flags & 2), *lists))
