"""The wire between a card and its emulated servos: who hears a packet, and who answers when.

Behaviour that firmware must cope with is taken at its worst: after a missing servo, the others
never answer a sync read. Times are µs on the card's clock.
"""

import struct
from collections.abc import Callable

from miburi.emulation.packets import (
    BROADCAST,
    PING,
    READ,
    REBOOT,
    STATUS,
    SYNC_READ,
    SYNC_WRITE,
    WRITE,
    packet,
    packets,
)
from miburi.emulation.servos import INSTRUCTION_ERROR, Servo

__all__ = ["BAUDS", "Bus"]

#: Bits a second by the register's value, and by which part two that understand each other differ.
BAUDS = (9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000)
_BAUD_TOLERANCE = 0.03
#: A packet that pauses for longer, in µs, is not completed.
_PAUSE = 2_000


class Bus:
    """The wire between card and servos.

    Attributes
    ----------
    servos
        In any order; ids must differ.
    spoil
        Changes bytes on their way, from the card and to it.
    instructions
        How many whole instruction packets the servos have heard.
    """

    def __init__(self, servos: list[Servo], baud: int = 1_000_000) -> None:
        self.servos = servos
        self.spoil: Callable[[bytes], bytes] = lambda data: data
        self.instructions = 0
        self._byte = 1e7 / baud
        self._alive: list[Servo] = []
        self._begun, self._last = b"", 0.0

    def answer(self, data: bytes, time: float, baud: int = 1_000_000) -> list[tuple[float, bytes]]:
        """Let the servos of this speed hear a burst of bytes that ended at ``time``.

        Returns
        -------
        Bytes that they send, each with the time at which it begins.
        """
        answers: list[tuple[float, bytes]] = []
        begun = self._begun if time - self._last < _PAUSE else b""
        heard, self._begun = packets(begun + self.spoil(data))
        self._last = time
        for servo, instruction, parameters in heard:
            if instruction == STATUS:
                continue
            self.instructions += 1
            alive = self._alive = [
                one
                for one in self.servos
                if not one.dead and abs(BAUDS[one.get("baud")] / baud - 1) < _BAUD_TOLERANCE
            ]
            for one in alive:
                one.heard(time)
            if instruction == SYNC_READ:
                answers += self._sync_read(parameters, time)
            elif instruction == SYNC_WRITE:
                self._sync_write(parameters, time)
            else:
                for one in alive:
                    if servo in (one.get("id"), BROADCAST):
                        answers += self._single(one, servo, instruction, parameters, time)
        return [(start, self.spoil(said)) for start, said in answers]

    def _say(self, one: Servo, error: int, data: bytes, time: float) -> tuple[float, bytes]:
        start = time + 2 * one.get("return_delay") + one.delay
        servo = one.get("id") if one.alias is None else one.alias
        return start, packet(servo, STATUS, bytes((error,)) + data)

    def _sync_read(self, parameters: bytes, time: float) -> list[tuple[float, bytes]]:
        if len(parameters) < 5:
            return []
        address, count = struct.unpack_from("<HH", parameters)
        by_id = {one.get("id"): one for one in self._alive}
        answers = []
        for servo in parameters[4:]:
            one = by_id.get(servo)
            if one is None:
                break
            error, data = one.read(address, count, time)
            start, said = self._say(one, error, data, time)
            answers.append((start, said))
            time = start + len(said) * self._byte
        return answers

    def _sync_write(self, parameters: bytes, time: float) -> None:
        if len(parameters) < 4:
            return
        address, count = struct.unpack_from("<HH", parameters)
        by_id = {one.get("id"): one for one in self._alive}
        for at in range(4, len(parameters) - count, count + 1):
            one = by_id.get(parameters[at])
            if one is not None:
                one.write(address, parameters[at + 1 : at + 1 + count], time)

    def _single(
        self, one: Servo, servo: int, instruction: int, parameters: bytes, time: float
    ) -> list[tuple[float, bytes]]:
        data = b""
        if instruction == PING:
            error, data = one.read(0, 2, time)
            data += bytes((one.get("firmware"),))
        elif instruction == READ and len(parameters) == 4:
            address, count = struct.unpack("<HH", parameters)
            error, data = one.read(address, count, time)
        elif instruction == WRITE and len(parameters) > 2:
            answers = one.get("id")
            error = one.write(struct.unpack_from("<H", parameters)[0], parameters[2:], time)
            if one.get("id") != answers:
                # The answer to a change of id still comes under the old one.
                said = packet(answers, STATUS, bytes((error,)))
                return [(time + 2 * one.get("return_delay") + one.delay, said)]
        elif instruction == REBOOT:
            one.power_up()
            error = 0
        else:
            error = INSTRUCTION_ERROR
        # Status return level: 0 answers pings alone, 1 reads too, 2 all.
        least = {PING: 0, READ: 1}.get(instruction, 2)
        if one.get("status_return_level") < least or (servo == BROADCAST and instruction != PING):
            return []
        return [self._say(one, error, data, time)]
