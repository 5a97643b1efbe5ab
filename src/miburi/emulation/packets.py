"""Build packets of DYNAMIXEL's protocol 2.0, and find them among the bytes on a wire."""

import struct

from miburi.card.link import crc16

__all__ = [
    "ACTION",
    "BROADCAST",
    "BULK_READ",
    "BULK_WRITE",
    "CLEAR",
    "FACTORY_RESET",
    "FAST_BULK_READ",
    "FAST_SYNC_READ",
    "PING",
    "READ",
    "REBOOT",
    "REG_WRITE",
    "STATUS",
    "SYNC_READ",
    "SYNC_WRITE",
    "WRITE",
    "fast_blocks",
    "packet",
    "packets",
]

PING, READ, WRITE, REG_WRITE, ACTION = 0x01, 0x02, 0x03, 0x04, 0x05
FACTORY_RESET, REBOOT, CLEAR, STATUS = 0x06, 0x08, 0x10, 0x55
SYNC_READ, SYNC_WRITE, FAST_SYNC_READ = 0x82, 0x83, 0x8A
BULK_READ, BULK_WRITE, FAST_BULK_READ = 0x92, 0x93, 0x9A
BROADCAST = 0xFE
_HEADER = b"\xff\xff\xfd\x00"


def packet(servo: int, instruction: int, parameters: bytes = b"") -> bytes:
    """Put an instruction packet together; for a status packet the parameters begin with the error.

    Parameters
    ----------
    servo
        Id 0–252, or ``BROADCAST``.
    """
    stuffed = (bytes((instruction,)) + parameters).replace(b"\xff\xff\xfd", b"\xff\xff\xfd\xfd")
    head = _HEADER + bytes((servo,)) + struct.pack("<H", len(stuffed) + 2)
    return head + stuffed + struct.pack("<H", crc16(head + stuffed))


def fast_blocks(answers: list[tuple[int, int, bytes]], counts: list[int]) -> list[bytes]:
    """Return what each servo adds to the one status packet of a fast read.

    A block is the error, the id, the data, and the checksum of all that was sent so far; the header
    comes before the first. There is no byte stuffing.

    Parameters
    ----------
    answers
        Error, id and data of each servo, in their order.
    counts
        Bytes of data from each queried servo, for the header, even if some do not answer.
    """
    length = 1 + sum(4 + count for count in counts)
    said, blocks = b"", []
    for error, servo, data in answers:
        head = b"" if said else _HEADER + bytes((BROADCAST,)) + struct.pack("<HB", length, STATUS)
        block = head + bytes((error, servo)) + data
        block += struct.pack("<H", crc16(said + block))
        said += block
        blocks.append(block)
    return blocks


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
