"""The card's limits: its stack, a servo's wildest speed, and what a bad servo may cost it."""

import struct
from pathlib import Path

import numpy as np
import pytest
from tests.firmware.endings import raise_arms
from tests.firmware.rig import Rig
from tests.firmware.test_faults import symbol

from miburi.card.card import wake
from miburi.card.link import FrameKind
from miburi.errors import BodyError
from miburi.robot import JOINTS
from miburi.safety.stop import Phase, StopReason

#: Where the Mega has its stack pointer. Bytes that must stay unused.
STACK_POINTER, SPARE = 0x5D, 1024
PAINT = 0xC5


@pytest.mark.parametrize("says", [2**31 - 1, -(2**31), 1_400_000])
def test_a_speed_that_no_servo_has_is_cut_short(rig: Rig, says: int) -> None:
    """Times 1563, it overflowed: the largest speed forwards was read as a slow one backwards."""
    servo, joint = rig.servos[2], rig.settings.joints[2]
    read = servo.read

    def lie(address: int, count: int, time: float) -> tuple[int, bytes]:
        error, data = read(address, count, time)
        return error, struct.pack("<i", says) + data[4:] if address == 128 else data

    servo.read = lie  # type: ignore[method-assign]
    rig.run(0.1)
    told = rig.body.report.speeds[2] * joint.direction
    assert abs(told) > 30_000
    assert (told > 0) == (says > 0)


def ceilings(rig: Rig) -> list[int]:
    return [servo.get("goal_pwm") for servo in rig.servos]


def test_a_ceiling_that_a_servo_has_lost_is_sent_again(rig: Rig) -> None:
    """At rest: in motion there is no time beside the readings."""
    raise_arms(rig, speed=0.5)
    order = rig.body.underway.order
    assert order is not None
    assert ceilings(rig) == order.cruise.tolist() != order.pwm.tolist()
    assert rig.settle() is Phase.IDLE
    rig.servos[6].set("goal_pwm", 885)
    rig.run(0.3)
    assert ceilings(rig) == order.cruise.tolist()
    assert rig.body.state.phase is Phase.IDLE


def test_a_servo_that_takes_no_ceiling_is_named(rig: Rig) -> None:
    raise_arms(rig, speed=0.5)
    assert rig.settle() is Phase.IDLE
    servo = rig.servos[6]
    write = servo.write

    def without_ceiling(address: int, data: bytes, time: float) -> int:
        return 0 if address == 100 and len(data) == 2 else write(address, data, time)

    servo.write = without_ceiling  # type: ignore[method-assign]
    servo.set("goal_pwm", 885)
    rig.run(0.5)
    assert rig.cause == (StopReason.SERVO_DEAF, JOINTS[6])


def test_the_stack_leaves_a_kilobyte(rig: Rig, firmware: Path) -> None:
    """Painted before, and measured after, all that a card does."""
    mega = rig.line.mega
    used = symbol(firmware, "__bss_end") & 0xFFFF
    # Nothing uses the heap: all up to the stack is free.
    (stack,) = struct.unpack("<H", mega.peek(STACK_POINTER, 2))
    mega.poke(used, bytes([PAINT]) * (stack - used))
    raise_arms(rig)
    shaft = rig.servos[1].shaft
    shaft.low = shaft.high = shaft.place
    rig.run(0.4)
    assert rig.body.state.phase is Phase.STOPPED
    shaft.low, shaft.high = -np.inf, np.inf
    rig.body.configure(rig.settings)
    rig.body.ask(FrameKind.SAVE)
    rig.run(0.5)
    rig.body.ask(FrameKind.PEEK, bytes((3, 128, 12)))
    with pytest.raises(BodyError):
        rig.body.identify(20, 21)
    rig.servos[4].dead = True
    rig.run(0.3)
    rig.servos[4].dead = False
    rig.run(0.3)
    wake(rig.body)
    free = next(n for n, byte in enumerate(mega.peek(used, stack - used)) if byte != PAINT)
    print(f"{free} bytes between data and stack were never used")
    assert free > SPARE
