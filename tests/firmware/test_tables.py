"""What the card writes into its servos' tables, and reads back."""

from pathlib import Path

import pytest
from tests.firmware.endings import raise_arms, recovers
from tests.firmware.rig import Rig

from miburi.card.card import wake
from miburi.cli.by_hand import prepare
from miburi.emulation.control_table import REGISTERS
from miburi.emulation.servos import Servo
from miburi.errors import BodyError
from miburi.robot import JOINTS
from miburi.safety.stop import Phase, StopReason


def test_faulty_servo_is_restarted_by_a_release(rig: Rig) -> None:
    raise_arms(rig)
    rig.servos[2].fail(4)
    rig.run(0.2)
    assert rig.cause == (StopReason.SERVO_FAULTY, JOINTS[2])
    with pytest.raises(BodyError, match="hardware error"):
        rig.body.release()
    recovers(rig)


def test_deaf_servo_is_named(rig: Rig) -> None:
    rig.servos[4].deaf = True
    rig.turn([1, 4], by=1.0, speed=1.0)
    rig.run(0.1)
    assert rig.cause == (StopReason.SERVO_DEAF, JOINTS[4])
    assert rig.at_rest()
    with pytest.raises(BodyError, match="does not accept commands"):
        rig.body.release()
    rig.servos[4].deaf = False
    recovers(rig)


def test_who_loses_the_cards_gains_is_named_and_gets_them_back(rig: Rig) -> None:
    general, servo = rig.settings.general, rig.servos[3]
    gains = ("position_d_gain", "position_i_gain", "position_p_gain")
    gains += ("feedforward_2nd_gain", "feedforward_1st_gain")
    ours = [general.d_gain, 0, general.p_gain, 0, 0]
    assert [[one.get(name) for name in gains] for one in rig.servos] == [ours] * 8
    for name, other in zip(gains, (10, 20, 400, 30, 40), strict=True):
        servo.set(name, other)
        rig.run(0.3)
        assert rig.cause == (StopReason.SERVO_RESTARTED, JOINTS[3])
        wake(rig.body)
        assert [servo.get(name) for name in gains] == ours


def test_a_servo_that_takes_no_gains_is_refused(rig: Rig) -> None:
    rig.body.stop()
    servo, write = rig.servos[6], rig.servos[6].write
    servo.set("position_p_gain", 400)

    def but_gains(address: int, data: bytes, time: float) -> int:
        return 0 if address == 80 else write(address, data, time)

    servo.write = but_gains  # type: ignore[method-assign]
    with pytest.raises(BodyError, match=f"{JOINTS[6]}: servo does not accept commands"):
        wake(rig.body)
    servo.write = write  # type: ignore[method-assign]
    recovers(rig)


def test_only_what_the_manual_defines_is_read(rig: Rig) -> None:
    """What a servo says of the addresses between its registers, the manual leaves open."""
    defined = {
        at
        for register in REGISTERS.values()
        for at in range(register.address, register.address + register.size)
    }
    asked = set[int]()
    for servo in rig.servos:

        def read(address: int, count: int, time: float, one: Servo = servo) -> tuple[int, bytes]:
            asked.update(range(address, address + count))
            return Servo.read(one, address, count, time)

        servo.read = read  # type: ignore[method-assign]
    rig.body.stop()
    wake(rig.body)
    raise_arms(rig)
    assert rig.settle() is Phase.IDLE
    rig.run(0.6)  # it looks at health and gains meanwhile
    assert asked >= {80, 85, 88, 91, 146}
    assert asked <= defined, sorted(asked - defined)


def test_a_servo_never_gets_torque_back_by_itself(rig: Rig) -> None:
    """Its Startup Configuration may bring torque and, from a backup, another goal."""
    for startup in (1, 2, 3):
        rig.body.stop()
        rig.servos[5].set("startup", startup)
        wake(rig.body)
        assert [servo.get("startup") for servo in rig.servos] == [0] * 8
        rig.servos[5].power_up()
        assert rig.servos[5].get("torque_enable") == 0


def test_a_servo_whose_firmware_has_no_startup_configuration_is_taken(rig: Rig) -> None:
    """Register 60 came with firmware 46."""
    rig.body.stop()
    servo = rig.servos[5]

    def read(address: int, count: int, time: float) -> tuple[int, bytes]:
        return (7, b"") if address == 60 else Servo.read(servo, address, count, time)

    servo.read = read  # type: ignore[method-assign]
    recovers(rig)


def test_servos_on_the_table_are_numbered_and_nothing_moves(firmware: Path) -> None:
    """They are connected one by one, by a person who has no robot yet."""
    rig = Rig(firmware, awake=False, twin=False)
    asked: list[str] = []

    def connect(what: str) -> None:
        if what == "Unplug it":
            rig.bus.servos[:] = []
            return
        asked.append(what)
        rig.bus.servos[:] = [Servo.new(1)]
        rig.bus.servos[0].set("baud", 1)

    assert not prepare(rig.body, connect, ids=True, zeros=False, built=False)
    assert [what.removeprefix("Connect only the servo of the ") for what in asked] == [
        joint.replace("_", " ") for joint in JOINTS
    ]
    assert rig.bus.servos[0].get("id") == 8
    assert not rig.bus.servos[0].get("torque_enable")
    rig.close()


def test_a_servo_that_has_its_number_gets_no_other(firmware: Path) -> None:
    """A person who forgets to unplug it, or plugs the next one into it, is told its number."""
    rig = Rig(firmware, awake=False, twin=False)
    kept, asked = list[Servo](), list[str]()

    def forget(what: str) -> str:
        asked.append(what)
        match what.split(maxsplit=1)[0]:
            case "Connect":
                fresh = Servo.new(1)
                fresh.set("baud", 1)
                # One that came along from another project, at the bus's speed.
                rig.bus.servos[:] = [*kept[1:2], fresh] if len(kept) < 3 else [Servo.new(1)]
                kept.append(rig.bus.servos[-1])
            case "Unplug" if what != "Unplug it":
                rig.bus.servos[:] = [rig.bus.servos[-1]]
            case "Servo":
                rig.bus.servos[:] = []
        return ""

    assert not prepare(rig.body, forget, ids=True, zeros=False, built=False)
    assert [servo.get("id") for servo in kept] == [1, 2, 3, 4, 5, 6, 7, 8]
    assert asked[1:3] == ["Unplug it", "Servo 1 still answers. Unplug it"]
    (told,) = [what for what in asked if what.startswith("Unplug servo 2, and connect only")]
    assert told.endswith("of the right elbow; or type 2 to give it the number 3 instead")
    rig.close()


def test_servos_with_wrong_numbers_are_numbered_again(firmware: Path) -> None:
    rig = Rig(firmware, awake=False, twin=False)
    servos = [Servo.new(number) for number in (2, 1, 5, 3, 5, 6, 7, 8)]
    names = [name.replace("_", " ") for name in JOINTS]

    def connect(what: str) -> str:
        if what.startswith("Connect"):
            rig.bus.servos[:] = [servos[names.index(what.partition(" of the ")[2])]]
        elif what == "Unplug it":
            rig.bus.servos[:] = []
        return what.removeprefix("Unplug servo ").partition(",")[0]

    assert not prepare(rig.body, connect, ids=True, zeros=False, built=False)
    assert [servo.get("id") for servo in servos] == [1, 2, 3, 4, 5, 6, 7, 8]
    rig.close()


def test_identify_gives_a_servo_its_id_and_its_settings(firmware: Path) -> None:
    """As from the factory, half-done, late, or at the speeds of other projects."""
    rig = Rig(firmware, awake=False, twin=False)
    half_done = {"drive_mode": 4, "operating_mode": 4, "return_delay": 250, "startup": 3}
    for number, entries, late in (
        (1, {"baud": 1}, 0.0),
        (7, {"baud": 1}, 20_000.0),
        (7, {"return_delay": 25}, 0.0),
        (1, {"baud": 0}, 0.0),
        (1, {"baud": 2}, 0.0),
        (1, {"baud": 4}, 0.0),
        (1, half_done, 30_000.0),
    ):
        before, fresh = rig.body.report.time, Servo.new(number)
        for name, value in entries.items():
            fresh.set(name, value)
        fresh.delay = late
        rig.bus.servos[:] = [fresh]
        rig.body.identify(1, 7)
        names = ("id", "baud", "drive_mode", "operating_mode", "return_delay", "startup")
        assert [fresh.get(name) for name in names] == [7, 3, 0, 3, 25, 0], entries
        rig.run(0.1)
        assert rig.body.report.time > before  # so long a wait did not wake the watchdog
    with pytest.raises(BodyError, match="servo does not answer"):
        rig.body.identify(3, 4)
    rig.run(0.1)
    assert rig.body.report.time > before
    rig.close()
