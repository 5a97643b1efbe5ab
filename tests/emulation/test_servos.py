"""The emulated servos speak protocol 2.0: the official SDK is the judge."""

import pytest
from dynamixel_sdk import (
    COMM_RX_TIMEOUT,
    COMM_SUCCESS,
    GroupSyncRead,
    GroupSyncWrite,
    PacketHandler,
)
from tests.emulation.port import Port

from miburi.emulation.bus import Bus
from miburi.emulation.servos import SPEED_UNIT, Servo

SDK = PacketHandler(2.0)


@pytest.fixture
def port() -> Port:
    return Port(Bus([Servo.new(i, 2000.0 + i) for i in range(1, 9)]))


def test_sdk_reads_writes_and_reboots(port: Port) -> None:
    for servo in range(1, 9):
        assert SDK.ping(port, servo) == (1200, COMM_SUCCESS, 0)
        assert SDK.read4ByteTxRx(port, servo, 132) == (2000 + servo, COMM_SUCCESS, 0)
    assert SDK.read4ByteTxRx(port, 9, 132)[1] == COMM_RX_TIMEOUT
    assert SDK.factoryReset(port, 1, 0xFF)[1] == 2  # a card sends no such instruction
    assert SDK.write1ByteTxRx(port, 3, 11, 16) == (COMM_SUCCESS, 0)
    assert SDK.write2ByteTxRx(port, 3, 84, 3200) == (COMM_SUCCESS, 0)
    assert SDK.write1ByteTxRx(port, 3, 64, 1) == (COMM_SUCCESS, 0)
    assert SDK.read1ByteTxRx(port, 3, 64) == (1, COMM_SUCCESS, 0)
    # While torque is on, writing to the EEPROM area is an access error.
    assert SDK.write1ByteTxRx(port, 3, 11, 3) == (COMM_SUCCESS, 7)
    assert SDK.reboot(port, 3)[0] == COMM_SUCCESS
    # The gains are lost with the power, and with another mode.
    assert SDK.read1ByteTxRx(port, 3, 64)[0] == 0
    assert SDK.read2ByteTxRx(port, 3, 84)[0] == 400
    SDK.write2ByteTxRx(port, 3, 84, 3200)
    SDK.write1ByteTxRx(port, 3, 11, 3)
    assert SDK.read2ByteTxRx(port, 3, 84)[0] == 400
    # A new id is taken at once, and answered under the old one.
    assert SDK.write1ByteTxRx(port, 3, 7, 30) == (COMM_SUCCESS, 0)
    assert SDK.read1ByteTxRx(port, 30, 7) == (30, COMM_SUCCESS, 0)


def test_sdk_reads_and_writes_values_that_need_byte_stuffing(port: Port) -> None:
    servo = port.bus.servos[0]
    servo.set("operating_mode", 4)
    for place in (-3, -1, 0x00FDFFFF, -65_539):
        servo.shaft.place = place
        value, result, error = SDK.read4ByteTxRx(port, 1, 132)
        assert (value & 0xFFFFFFFF, result, error) == (place & 0xFFFFFFFF, COMM_SUCCESS, 0)
        assert SDK.write4ByteTxRx(port, 1, 116, place & 0xFFFFFFFF) == (COMM_SUCCESS, 0)
        assert servo.get("goal_position") == place


def test_sdk_syncs(port: Port) -> None:
    write, read = GroupSyncWrite(port, SDK, 116, 4), GroupSyncRead(port, SDK, 132, 4)
    for servo in range(1, 9):
        write.addParam(servo, list((2000 + 10 * servo).to_bytes(4, "little")))
        read.addParam(servo)
        port.bus.servos[servo - 1].write(64, b"\x01", port.time)
    assert write.txPacket() == COMM_SUCCESS
    port.time += 100_000
    assert read.txRxPacket() == COMM_SUCCESS
    for servo in range(1, 9):
        assert read.getData(servo, 132, 4) == 2000 + 10 * servo


def test_after_a_missing_servo_a_sync_read_falls_silent(port: Port) -> None:
    read = GroupSyncRead(port, SDK, 132, 4)
    for servo in range(1, 9):
        read.addParam(servo)
    port.bus.servos[4].dead = True
    assert read.txRxPacket() != COMM_SUCCESS


def test_servos_with_one_id_talk_at_once_and_both_obey(port: Port) -> None:
    port.bus.servos[1].set("id", 1)
    assert SDK.read4ByteTxRx(port, 1, 132)[1] != COMM_SUCCESS  # they stand in different places
    assert SDK.read1ByteTxRx(port, 1, 7) == (1, COMM_SUCCESS, 0)
    SDK.write1ByteTxRx(port, 1, 64, 1)
    assert [servo.get("torque_enable") for servo in port.bus.servos[:3]] == [1, 1, 0]


def test_profile_speed_is_the_speed() -> None:
    servo = Servo.new(1, 0.0)
    servo.shaft.lag = 0.0
    servo.write(108, (50).to_bytes(4, "little") + (100).to_bytes(4, "little"), 0.0)
    servo.write(64, b"\x01", 0.0)
    servo.write(116, (4000).to_bytes(4, "little"), 0.0)
    servo.heard(1e6)
    before, after = (servo.shaft.position(servo, t) for t in (1.0e6, 1.1e6))
    assert (after - before) * 10 == pytest.approx(100 * SPEED_UNIT)


def test_a_servo_may_begin_late_and_count_its_own_time() -> None:
    """Twice as fast a clock brings it in half the time to its goal; until it begins, it rests."""

    def arrives(delay: float, clock: float) -> float:
        servo = Servo.new(1, 0.0)
        servo.start_delay, servo.clock = delay, clock
        servo.write(108, (50).to_bytes(4, "little") + (100).to_bytes(4, "little"), 0.0)
        servo.write(64, b"\x01", 0.0)
        servo.write(116, (1000).to_bytes(4, "little"), 0.0)
        servo.write(98, b"\0", 0.0)
        assert servo.setpoint(delay) == 0
        return next(time for time in range(0, 3_000_000, 1000) if servo.setpoint(time) == 1000)

    plain = arrives(0.0, 1.0)
    assert arrives(3000.0, 1.0) == plain + 3000
    assert arrives(0.0, 2.0) == pytest.approx(plain / 2, abs=1000)


def test_bus_watchdog_stops_a_servo_that_hears_nothing() -> None:
    servo = Servo.new(1, 0.0)
    servo.write(64, b"\x01", 0.0)
    servo.write(98, bytes((10,)), 0.0)
    servo.write(108, (50).to_bytes(4, "little") + (20).to_bytes(4, "little"), 0.0)
    servo.write(116, (4000).to_bytes(4, "little"), 0.0)
    there = servo.setpoint(250_000)
    assert there == servo.setpoint(3e6) < 100
    assert servo.get("bus_watchdog") == -1
    assert servo.write(116, bytes(4), 3e6) == 4  # refused until the watchdog is cleared
    assert servo.write(98, bytes(1), 3e6) == 0
    assert servo.write(116, bytes(4), 3e6) == 0


@pytest.mark.parametrize(
    ("address", "value", "error"),
    [
        *[(address, b"\1", 7) for address in (6, 70, 122, 14, 150)],
        (0, b"\1\0", 7),
        *[(64, b"\2", 4), (11, b"\x09", 4), (8, b"\x63", 4), (9, b"\xff", 4), (7, b"\xfd", 4)],
        (102, (5000).to_bytes(2, "little"), 6),
        (116, (4096).to_bytes(4, "little"), 6),
        (116, b"\0\0", 5),
        (116, (4095).to_bytes(4, "little"), 0),
    ],
)
def test_what_a_servo_does_not_take_it_refuses_as_the_manual_says(
    port: Port, address: int, value: bytes, error: int
) -> None:
    before = bytes(port.bus.servos[0].table.data)
    said = SDK.writeTxRx(port, 1, address, len(value), list(value))
    assert said == (COMM_SUCCESS, error)
    assert (bytes(port.bus.servos[0].table.data) == before) == bool(error)


@pytest.mark.parametrize("how", ["reboot", "torque"])
def test_whole_turns_are_left_out_from_a_start_on(port: Port, how: str) -> None:
    """A limp joint across the seam: the servo counts from the other side, and stays there."""
    servo = port.bus.servos[0]
    servo.shaft.place = -10.0
    assert SDK.read4ByteTxRx(port, 1, 132)[0] - (1 << 32) == -10
    if how == "reboot":
        SDK.reboot(port, 1)
    else:
        SDK.write4ByteTxRx(port, 1, 116, 4086)
        SDK.write1ByteTxRx(port, 1, 64, 1)
    assert SDK.read4ByteTxRx(port, 1, 132)[0] == 4086
    assert servo.shaft.place == -10


def test_a_servo_may_have_torque_from_the_start(port: Port) -> None:
    assert SDK.write1ByteTxRx(port, 1, 60, 1) == (COMM_SUCCESS, 0)
    SDK.reboot(port, 1)
    assert [port.bus.servos[0].get(name) for name in ("torque_enable", "goal_position")] == [
        1,
        2001,
    ]


def test_a_servo_that_shut_down_gets_torque_only_after_a_reboot(port: Port) -> None:
    port.bus.servos[0].fail(32)
    assert SDK.write1ByteTxRx(port, 1, 64, 1) == (COMM_SUCCESS, 0x87)
    assert SDK.read1ByteTxRx(port, 1, 64)[0] == 0
    SDK.reboot(port, 1)
    assert SDK.write1ByteTxRx(port, 1, 64, 1) == (COMM_SUCCESS, 0)
