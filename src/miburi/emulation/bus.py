"""The wire between a card and its emulated servos: who hears a packet, and who answers when.

Where the manual leaves behaviour open, the worst case is modelled: if a servo is missing, those
that come after it never answer a sync read. Two servos that speak at once garble each other: the
wire is low when either pulls it low. Times are µs on the card's clock.
"""

import struct
from collections.abc import Callable

from miburi.emulation.packets import (
    ACTION,
    BROADCAST,
    BULK_READ,
    BULK_WRITE,
    CLEAR,
    FACTORY_RESET,
    FAST_BULK_READ,
    FAST_SYNC_READ,
    PING,
    READ,
    REBOOT,
    REG_WRITE,
    STATUS,
    SYNC_READ,
    SYNC_WRITE,
    WRITE,
    fast_blocks,
    packet,
    packets,
)
from miburi.emulation.servos import INSTRUCTION_ERROR, Servo

__all__ = ["BAUDS", "Bus"]

#: Bits per second for each value of the register Baud Rate, and the share by which two ends' speeds
#: may differ.
BAUDS = (9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000)
_BAUD_TOLERANCE = 0.03
#: A packet interrupted for longer than this, in µs, is dropped.
_PAUSE = 2_000
#: µs between the answers of successive ids to a broadcast ping, as the official SDK expects.
_PING_TURN = 3_000
#: The lowest status return level at which an instruction is answered; 2 for instructions not
#: listed.
_LEVELS = {PING: 0, READ: 1}
#: The highest id that may be a secondary one.
_LAST_ID = 252

#: Bytes of data that one fast answer can safely hold; longer reads get no answer.
_LONGEST = 60_000

#: When a servo's answer begins, and its bytes.
Answer = tuple[float, bytes]


class Bus:
    """The wire between card and servos.

    Attributes
    ----------
    servos
        In any order. Two with the same id speak at the same time.
    spoil
        Changes bytes in transit, from the card and to it.
    instructions
        How many whole instruction packets the servos have heard.
    """

    def __init__(self, servos: list[Servo]) -> None:
        self.servos = servos
        self.spoil: Callable[[bytes], bytes] = lambda data: data
        self.instructions = 0
        self._byte = 0.0
        self._alive: dict[int, list[Servo]] = {}  # the servos that are hearing a packet, by id
        self._begun, self._last = b"", 0.0

    def answer(self, data: bytes, time: float, baud: int = 1_000_000) -> list[Answer]:
        """Deliver a burst of bytes, which ended at ``time``, to the servos set to ``baud``.

        Returns
        -------
        The bytes that they send, in bursts, each with the time at which it begins.
        """
        answers: list[Answer] = []
        begun = self._begun if time - self._last < _PAUSE else b""
        heard, self._begun = packets(begun + self.spoil(data))
        self._last, self._byte = time, 1e7 / baud
        for servo, instruction, parameters in heard:
            if instruction == STATUS:
                continue
            self.instructions += 1
            self._alive = {}
            for one in self.servos:
                if not one.dead and abs(BAUDS[one.get("baud")] / baud - 1) < _BAUD_TOLERANCE:
                    one.heard(time)
                    self._alive.setdefault(one.get("id"), []).append(one)
            answers += self._collide(self._obey(servo, instruction, parameters, time))
        return [(start, self.spoil(said)) for start, said in answers]

    def _obey(self, servo: int, instruction: int, parameters: bytes, time: float) -> list[Answer]:
        if instruction in (SYNC_READ, FAST_SYNC_READ):
            if len(parameters) < 5:
                return []
            address, count = struct.unpack_from("<HH", parameters)
            asked = [(one, address, count) for one in parameters[4:]]
            return self._read_in_turn(asked, time, fast=instruction == FAST_SYNC_READ)
        if instruction in (BULK_READ, FAST_BULK_READ):
            asked = list(struct.iter_unpack("<BHH", parameters[: len(parameters) // 5 * 5]))
            return self._read_in_turn(asked, time, fast=instruction == FAST_BULK_READ)
        if instruction == SYNC_WRITE and len(parameters) >= 4:
            address, count = struct.unpack_from("<HH", parameters)
            for at in range(4, len(parameters) - count, count + 1):
                self._write(parameters[at], address, parameters[at + 1 : at + 1 + count], time)
            return []
        if instruction == BULK_WRITE:
            at = 0
            while at + 5 <= len(parameters):
                one, address, count = struct.unpack_from("<BHH", parameters, at)
                self._write(one, address, parameters[at + 5 : at + 5 + count], time)
                at += 5 + count
            return []
        answers = []
        for one in (one for those in self._alive.values() for one in those):
            if servo in (one.get("id"), BROADCAST):
                answers += self._single(one, servo, instruction, parameters, time)
            elif self._shares(one, servo) and instruction == WRITE and len(parameters) > 2:
                address = struct.unpack_from("<H", parameters)[0]
                one.write(address, parameters[2:], time, shared=True)
        return answers

    def _shares(self, one: Servo, servo: int) -> bool:
        return servo == one.get("secondary_id") <= _LAST_ID

    def _collide(self, answers: list[Answer]) -> list[Answer]:
        """Return the bytes on the wire when several servos speak at once."""
        merged: list[Answer] = []
        for start, said in sorted(answers, key=lambda answer: answer[0]):
            if merged and start < merged[-1][0] + len(merged[-1][1]) * self._byte:
                first, other = merged.pop()
                offset = round((start - first) / self._byte)
                wire = bytearray(max(len(other), offset + len(said)))
                wire[: len(other)] = other
                for at, byte in enumerate(said, offset):
                    wire[at] = byte & wire[at] if at < len(other) else byte
                merged.append((first, bytes(wire)))
            else:
                merged.append((start, said))
        return merged

    def _say(self, one: Servo, error: int, data: bytes, time: float) -> Answer:
        start = time + 2 * one.get("return_delay") + one.delay
        servo = one.get("id") if one.alias is None else one.alias
        return start, packet(servo, STATUS, bytes((error,)) + data)

    def _read_in_turn(
        self, asked: list[tuple[int, int, int]], time: float, *, fast: bool
    ) -> list[Answer]:
        """Let the servos answer in turn; those that come after a missing one do not answer."""
        counts = [width for _, _, width in asked]
        if fast and sum(counts) > _LONGEST:
            return []
        answers: list[Answer] = []
        blocks: list[tuple[int, int, bytes]] = []
        for servo, address, count in asked:
            if servo not in self._alive:
                break
            said = []
            for one in self._alive[servo]:
                error, data = one.read(address, count, time)
                if fast:
                    block = (error, servo, data.ljust(count, b"\0"))
                    start, _ = self._say(one, error, data, time) if not blocks else (time, b"")
                    said.append((start, fast_blocks([*blocks, block], counts)[-1]))
                else:
                    said.append(self._say(one, error, data, time))
            if fast:
                blocks.append(block)
            answers += said
            time = max(start + len(spoken) * self._byte for start, spoken in said)
        return answers

    def _write(self, servo: int, address: int, data: bytes, time: float) -> None:
        for one in self._alive.get(servo, ()):
            one.write(address, data, time)

    def _single(
        self, one: Servo, servo: int, instruction: int, parameters: bytes, time: float
    ) -> list[Answer]:
        data, to_all = b"", servo == BROADCAST
        # A change of id or speed is still answered under the old id, at the old speed.
        own = one.get("id") if one.alias is None else one.alias
        start = time + 2 * one.get("return_delay") + one.delay
        level = one.get("status_return_level")
        if instruction == PING:
            error, data = one.read(0, 2, time)
            data += bytes((one.get("firmware"),))
            start += _PING_TURN * own if to_all else 0.0
        elif instruction == READ and len(parameters) == 4:
            address, count = struct.unpack("<HH", parameters)
            error, data = one.read(address, count, time)
        elif instruction == WRITE and len(parameters) > 2:
            error = one.write(struct.unpack_from("<H", parameters)[0], parameters[2:], time)
        elif instruction == REG_WRITE and len(parameters) > 2:
            error = one.register(struct.unpack_from("<H", parameters)[0], parameters[2:])
        elif instruction == ACTION:
            error = one.act(time)
        elif instruction == FACTORY_RESET and len(parameters) == 1:
            error = one.reset(parameters[0], to_all=to_all)
        elif instruction == CLEAR:
            error = one.clear(parameters, time)
        elif instruction == REBOOT:
            one.power_up()
            error = 0
        else:
            error = INSTRUCTION_ERROR
        if level < _LEVELS.get(instruction, 2) or (to_all and instruction != PING):
            return []
        return [(start, packet(own, STATUS, bytes((error,)) + data))]
