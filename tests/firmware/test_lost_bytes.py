"""A bus that loses bytes: on the real binary, no lost byte looks like a contact or fails a release.

``make firmware-proof`` asks for more moves, at the losses of a good and of a bad bus.
"""

import os
from collections import Counter
from collections.abc import Callable, Container
from itertools import accumulate
from pathlib import Path

import pytest
from tests.firmware.rig import Rig
from tests.firmware.toolchain import changed_card

from miburi.card.card import wake
from miburi.safety.move import plan_move
from miburi.safety.stop import Phase

#: Free moves at each loss; `make firmware-proof` asks for 500.
MOVES = int(os.environ.get("MIBURI_LOSS", "6"))
#: How an order and its check begin: an instruction, and the register's address.
ORDER, CHECK = b"\x83\x64", b"\x82\x6c"


class Damage:
    """Damages packets on the bus: of those for which ``at`` is true, those with these numbers."""

    def __init__(
        self, rig: Rig, at: Callable[[bytes], bool], numbers: Container[int] = (0,)
    ) -> None:
        self.at, self.numbers, self.seen, self.done = at, numbers, 0, 0
        rig.bus.spoil = self

    def __call__(self, data: bytes) -> bytes:
        if self.at(data):
            self.seen += 1
            if self.seen - 1 in self.numbers:
                self.done += 1
                middle = len(data) // 2
                return data[:middle] + bytes((data[middle] ^ 0x10,)) + data[middle + 1 :]
        return data


def is_order(data: bytes) -> bool:
    return data[7:9] == ORDER


def is_check(data: bytes) -> bool:
    return data[7:9] == CHECK


class AfterCheck:
    """Whether a packet is the answer of a servo to an order's check."""

    def __init__(self, servo: int) -> None:
        self.servo, self.asked = servo, False

    def __call__(self, data: bytes) -> bool:
        if data[7:8] != b"\x55":
            self.asked = is_check(data)
        return self.asked and data[7:8] == b"\x55" and data[4] == self.servo


TWICE = (is_order, (0, 1), (0.3, 0.4, 1.0))


@pytest.mark.parametrize(
    ("at", "numbers", "durations"),
    [
        (is_order, (0,), (0.3, 0.4, 0.5, 0.7, 1.0, 1.4, 2.0)),
        (is_check, (0,), (0.3, 0.7)),
        (AfterCheck(3), (0,), (0.3, 0.7)),
        (AfterCheck(8), (0,), (0.3, 0.7)),
        TWICE,
    ],
)
def test_a_damaged_order_makes_no_move_a_contact(
    rig: Rig, at: Callable[[bytes], bool], numbers: tuple[int, ...], durations: tuple[float, ...]
) -> None:
    there = rig.robot.neutral.copy()
    there[[0, 1, 4]] += 0.6, 1.0, 1.0
    ends = (there, rig.robot.neutral)
    for index, seconds in enumerate(durations):
        damage = Damage(rig, at, numbers)
        here = rig.body.state.angles
        rig.body.move(plan_move(rig.robot, here, ends[index % 2], seconds))
        assert damage.done == len(numbers)
        assert rig.settle() is Phase.IDLE, (seconds, rig.body.state.stop)


def test_a_servo_that_missed_the_first_copy_is_expected_later_than_the_others(rig: Rig) -> None:
    servo = rig.servos[1]
    write, missed = servo.write, 0

    def miss_once(address: int, data: bytes, time: float) -> int:
        nonlocal missed
        if address == 100 and len(data) == 20 and not missed:
            missed = 1
            return 0
        return write(address, data, time)

    servo.write = miss_once  # type: ignore[method-assign]
    there = rig.robot.neutral.copy()
    for seconds, angle in ((0.3, 1.2), (0.4, -1.2), (0.6, 1.2)):
        missed = 0
        there[[1, 4]] += angle
        rig.body.move(plan_move(rig.robot, rig.body.state.angles, there, seconds))
        assert missed
        assert rig.settle() is Phase.IDLE, (seconds, rig.body.state.stop)


def test_a_card_keeps_up_with_servos_that_answer_without_a_pause(rig: Rig) -> None:
    """Built by GCC 14, it looked at the clock too often to take all bytes in, and was deaf."""
    answer, heard = rig.bus.answer, Counter[bytes]()

    def at_once(data: bytes, time: float, baud: int = 1_000_000) -> list[tuple[float, bytes]]:
        said = answer(data, time, baud)
        heard[data[7:9]] += 1
        places = accumulate((len(packet) * 1e7 / baud for _, packet in said), initial=0.0)
        return [
            (said[0][0] + place, packet) for place, (_, packet) in zip(places, said, strict=False)
        ]

    rig.bus.answer = at_once  # type: ignore[method-assign]
    for _ in range(3):
        rig.body.move(rig.random_move())
        assert rig.settle() is Phase.IDLE, rig.body.state.stop
    # Nobody had to be asked again, but for a byte that three interrupts in a row cost: two of some
    # 1,500 readings, as in firmwares before.
    assert heard[CHECK] <= 3 + rig.line.mega.dropped(1)
    assert rig.line.mega.dropped(1) <= 1


def test_a_stop_whose_limit_of_the_duty_a_servo_missed_says_it_again(rig: Rig) -> None:
    """Places and duty go out in two packets; the body is held when all have heard both."""
    soft, there = rig.settings.general.hold_pwm, rig.robot.neutral.copy()
    for servo in rig.servos:
        there[1] *= -1
        rig.body.move(plan_move(rig.robot, rig.body.state.angles, there, 1.0))
        rig.run(0.1)
        write, missed = servo.write, []

        def miss_once(address: int, data: bytes, time: float, write=write, missed=missed) -> int:
            if address == 100 and len(data) == 2 and not missed:
                missed.append(data)
                return 0
            return write(address, data, time)

        servo.write = miss_once
        rig.body.stop()
        rig.run(0.06)
        assert missed
        assert {each.get("goal_pwm") for each in rig.servos} == {soft}
        servo.write = write
        wake(rig.body)


@pytest.mark.proof("test_a_damaged_order_makes_no_move_a_contact")
def test_no_packet_of_a_release_is_so_dear_that_its_damage_fails_it(rig: Rig) -> None:
    """Every 25th packet is damaged: each in its turn."""
    for first in range(25):
        rig.body.stop()
        damage = Damage(rig, lambda _: True, range(first, 1000, 25))
        rig.body.release()
        assert damage.done > 3
        assert rig.settle() is Phase.IDLE, (first, rig.body.state.stop)
        assert {servo.get("bus_watchdog") for servo in rig.servos} == {10}


#: Changes to move.h, by what the changed card would do.
MUTANTS = {
    "expects all at once": ("guards.lag + late[i];", "guards.lag;"),
    "orders once": ("COPIES = 3;", "COPIES = 1;"),
}


@pytest.mark.proof("test_a_damaged_order_makes_no_move_a_contact")
@pytest.mark.parametrize("name", MUTANTS)
def test_a_card_that_orders_otherwise_is_noticed(firmware: Path, tmp_path: Path, name: str) -> None:
    rig = Rig(changed_card(tmp_path, "move.h", *MUTANTS[name]), twin=False)
    with pytest.raises(AssertionError):
        test_a_servo_that_missed_the_first_copy_is_expected_later_than_the_others(rig)
        test_a_damaged_order_makes_no_move_a_contact(rig, *TWICE)
    rig.close()


@pytest.mark.proof("test_a_damaged_order_makes_no_move_a_contact")
@pytest.mark.parametrize("rate", [1e-4, 1e-5])
def test_free_moves_on_a_bus_that_loses_bytes(firmware: Path, rate: float) -> None:
    """At 1e-5 none is stopped, at 1e-4 at most one of a thousand."""
    rig = Rig(firmware, 40, twin=False)
    lost, stopped = 0, []

    def lose(data: bytes) -> bytes:
        nonlocal lost
        gone = rig.rng.random(len(data)) < rate
        lost += int(gone.sum())
        return bytes(byte for byte, away in zip(data, gone, strict=True) if not away)

    for _ in range(MOVES):
        rig.shake()
        rig.bus.spoil = lose
        rig.body.move(rig.random_move())
        if rig.settle() is not Phase.IDLE:
            stopped.append(rig.body.state.stop)
            wake(rig.body)
        rig.bus.spoil = lambda data: data
    print(f"{MOVES} moves, {lost} bytes lost, {len(stopped)} stopped: {stopped}")
    assert lost > rate * 5_000 * MOVES - 3
    assert len(stopped) <= (MOVES / 1000 if rate > 1e-5 else 0)
    rig.close()
