"""The wire between a card and its emulated servos: who hears a packet, and who answers when.

Where the manual leaves behaviour open, the worst case is modelled: if a servo is missing, those
that come after it never answer a sync read. Servos with the same id answer at the same time, and
the wire is low while either pulls it low. The servos obey the instructions that a card sends, and a
ping; they refuse any other. Times are in µs on the card's clock.
"""

import struct
from collections.abc import Callable, Iterable
from functools import reduce
from itertools import chain, zip_longest
from operator import and_

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
)  # fmt: skip
from miburi.emulation.servos import Servo

#: Bits per second for each value of the register Baud Rate, and the share by which the speeds of
#: the two ends may differ.
_BAUDS = (9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000)
_BAUD_TOLERANCE = 0.03
#: A packet interrupted for longer than this, in µs, is dropped.
_PAUSE = 2_000
#: The error that a servo returns if it does not know an instruction.
_INSTRUCTION_ERROR = 0x02

#: When a servo's answer begins, in µs, and its bytes.
Answer = tuple[float, bytes]


class Bus:
    """The wire between card and servos.

    Attributes
    ----------
    servos
        The servos, in any order.
    spoil
        A function that changes bytes in transit, both from the card and to it.
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

        Returns the bytes that they send, in bursts, each with the time at which it begins.
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
                if not one.dead and abs(_BAUDS[one.get("baud")] / baud - 1) < _BAUD_TOLERANCE:
                    one.heard(time)
                    self._alive.setdefault(one.get("id"), []).append(one)
            answers += self._obey(servo, instruction, parameters, time)
        return [(start, self.spoil(said)) for start, said in answers]

    def _obey(self, servo: int, instruction: int, parameters: bytes, time: float) -> list[Answer]:
        if instruction == SYNC_READ and len(parameters) >= 4:
            return self._read_in_turn(parameters, time)
        if instruction == SYNC_WRITE and len(parameters) >= 4:
            address, count = struct.unpack_from("<HH", parameters)
            for at in range(4, len(parameters) - count, count + 1):
                for one in self._alive.get(parameters[at], ()):
                    one.write(address, parameters[at + 1 : at + 1 + count], time)
            return []
        if servo == BROADCAST:
            for one in chain(*self._alive.values()):
                self._answer_alone(one, instruction, parameters, time)
            return []
        return _at_once(
            self._answer_alone(one, instruction, parameters, time)
            for one in self._alive.get(servo, ())
        )

    def _read_in_turn(self, parameters: bytes, time: float) -> list[Answer]:
        """Let the servos answer in turn; those that come after a missing one do not answer."""
        answers: list[Answer] = []
        address, count = struct.unpack_from("<HH", parameters)
        for servo in parameters[4:]:
            said = _at_once(
                (time + self._delay(one), self._status(one, servo, *one.read(address, count, time)))
                for one in self._alive.get(servo, ())
            )
            if not said:
                break
            answers += said
            time = said[0][0] + len(said[0][1]) * self._byte
        return answers

    def _answer_alone(self, one: Servo, instruction: int, parameters: bytes, time: float) -> Answer:
        # When its id or delay is changed, a servo still answers with the old id and the old delay.
        own, start, data = one.get("id"), time + self._delay(one), b""
        if instruction == READ and len(parameters) == 4:
            address, count = struct.unpack("<HH", parameters)
            error, data = one.read(address, count, time)
        elif instruction == WRITE and len(parameters) > 2:
            error = one.write(struct.unpack_from("<H", parameters)[0], parameters[2:], time)
        elif instruction == PING:
            error, data = one.read(0, 2, time)
            data += bytes((one.get("firmware"),))
        elif instruction == REBOOT:
            one.power_up()
            error = 0
        else:
            error = _INSTRUCTION_ERROR
        return start, self._status(one, own, error, data)

    def _delay(self, one: Servo) -> float:
        return 2 * one.get("return_delay") + one.delay

    def _status(self, one: Servo, own: int, error: int, data: bytes) -> bytes:
        servo = own if one.alias is None else one.alias
        return packet(servo, STATUS, bytes((error,)) + data)


def _at_once(answers: Iterable[Answer]) -> list[Answer]:
    """Return the one answer that is heard if answers begin together; nothing without answers."""
    together = list(answers)
    if len(together) < 2:
        return together
    starts, said = zip(*together, strict=True)
    low = (reduce(and_, column) for column in zip_longest(*said, fillvalue=0xFF))
    return [(min(starts), bytes(low))]
