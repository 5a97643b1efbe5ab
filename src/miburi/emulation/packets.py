"""Build packets of DYNAMIXEL's protocol 2.0, and find them among the bytes on a wire."""

import struct

from miburi.card.link import crc16

#: The instructions that a card sends, the one by which a host finds a servo, and the one that marks
#: an answer.
READ, WRITE, REBOOT, SYNC_READ, SYNC_WRITE = 0x02, 0x03, 0x08, 0x82, 0x83
PING, STATUS = 0x01, 0x55
BROADCAST = 0xFE
_HEADER = b"\xff\xff\xfd\x00"


def packet(servo: int, instruction: int, parameters: bytes = b"") -> bytes:
    """Put an instruction packet together; for a status packet the parameters begin with the error.

    ``servo`` is an id, 0–252, or ``BROADCAST``.
    """
    stuffed = (bytes((instruction,)) + parameters).replace(b"\xff\xff\xfd", b"\xff\xff\xfd\xfd")
    head = _HEADER + bytes((servo,)) + struct.pack("<H", len(stuffed) + 2)
    return head + stuffed + struct.pack("<H", crc16(head + stuffed))


def packets(data: bytes) -> tuple[list[tuple[int, int, bytes]], bytes]:
    """Return the whole packets in ``data`` (id, instruction, parameters), and what follows them."""
    found, at, done = [], 0, 0
    while (at := data.find(_HEADER, at)) >= 0:
        if len(data) < at + 7:
            break
        (length,) = struct.unpack_from("<H", data, at + 5)
        end = at + 7 + length
        if length < 3 or end > len(data):
            at += 1
            continue
        if struct.unpack_from("<H", data, end - 2)[0] != crc16(data[at : end - 2]):
            at += 1
            continue
        body = data[at + 7 : end - 2].replace(b"\xff\xff\xfd\xfd", b"\xff\xff\xfd")
        found.append((data[at + 4], body[0], body[1:]))
        at = done = end
    return found, data[done:]
