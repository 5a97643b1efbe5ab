"""The emulated servos speak protocol 2.0: the official SDK is the judge."""

import pytest
from dynamixel_sdk import (
    COMM_RX_TIMEOUT,
    COMM_SUCCESS,
    GroupSyncRead,
    GroupSyncWrite,
    PacketHandler,
)

from miburi.emulation.servos import MODEL, SPEED_UNIT, Bus, Servo


class Port:
    """What the SDK takes for a serial port, with the emulated bus at its end."""

    is_using = False

    def __init__(self, bus: Bus) -> None:
        self.bus, self.time, self._said = bus, 0.0, b""

    def clearPort(self) -> None:  # noqa: N802
        self._said = b""

    def writePort(self, data: list[int]) -> int:  # noqa: N802
        self.time += 1000
        self._said += b"".join(said for _, said in self.bus.answer(bytes(data), self.time))
        return len(data)

    def readPort(self, count: int) -> bytes:  # noqa: N802
        said, self._said = self._said[:count], self._said[count:]
        return said

    def setPacketTimeout(self, _length: int) -> None:  # noqa: N802
        pass

    def setPacketTimeoutMillis(self, _ms: float) -> None:  # noqa: N802
        pass

    def isPacketTimeout(self) -> bool:  # noqa: N802
        return not self._said


@pytest.fixture
def port() -> Port:
    return Port(Bus([Servo.new(i, 2000.0 + i) for i in range(1, 9)]))


def test_sdk_pings_reads_and_writes(port: Port) -> None:
    sdk = PacketHandler(2.0)
    for servo in range(1, 9):
        assert sdk.ping(port, servo) == (MODEL, COMM_SUCCESS, 0)
        assert sdk.read4ByteTxRx(port, servo, 132) == (2000 + servo, COMM_SUCCESS, 0)
    assert sdk.ping(port, 9)[1] == COMM_RX_TIMEOUT
    assert sdk.write1ByteTxRx(port, 3, 11, 5) == (COMM_SUCCESS, 0)
    assert sdk.write1ByteTxRx(port, 3, 64, 1) == (COMM_SUCCESS, 0)
    assert sdk.read1ByteTxRx(port, 3, 64) == (1, COMM_SUCCESS, 0)
    # The EEPROM area is closed while torque is on: access error.
    assert sdk.write1ByteTxRx(port, 3, 11, 3) == (COMM_SUCCESS, 7)
    assert sdk.reboot(port, 3)[0] == COMM_SUCCESS
    assert sdk.read1ByteTxRx(port, 3, 64)[0] == 0


def test_sdk_reads_what_needs_stuffing(port: Port) -> None:
    sdk = PacketHandler(2.0)
    for place in (-3, -1, 0x00FDFFFF, -65_539):
        port.bus.servos[0].shaft.place = place
        value, result, error = sdk.read4ByteTxRx(port, 1, 132)
        assert (value & 0xFFFFFFFF, result, error) == (place & 0xFFFFFFFF, COMM_SUCCESS, 0)
        assert sdk.write4ByteTxRx(port, 1, 116, place & 0xFFFFFFFF) == (COMM_SUCCESS, 0)
        assert port.bus.servos[0].get("goal_position") == place


def test_sdk_syncs(port: Port) -> None:
    sdk = PacketHandler(2.0)
    write, read = GroupSyncWrite(port, sdk, 116, 4), GroupSyncRead(port, sdk, 132, 4)
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
    read = GroupSyncRead(port, PacketHandler(2.0), 132, 4)
    for servo in range(1, 9):
        read.addParam(servo)
    port.bus.servos[4].dead = True
    assert read.txRxPacket() != COMM_SUCCESS


def test_profile_speed_is_the_speed() -> None:
    servo = Servo.new(1, 0.0)
    servo.shaft.lag = 0.0
    servo.write(108, (50).to_bytes(4, "little") + (100).to_bytes(4, "little"), 0.0)
    servo.write(64, b"\x01", 0.0)
    servo.write(116, (4000).to_bytes(4, "little"), 0.0)
    servo.heard(1e6)
    before, after = (servo.shaft.position(servo, t) for t in (1.0e6, 1.1e6))
    assert (after - before) * 10 == pytest.approx(100 * SPEED_UNIT)


def test_bus_watchdog_stops_a_servo_that_hears_nothing() -> None:
    servo = Servo.new(1, 0.0)
    servo.write(64, b"\x01", 0.0)
    servo.write(98, bytes((10,)), 0.0)
    servo.write(108, (50).to_bytes(4, "little") + (20).to_bytes(4, "little"), 0.0)
    servo.write(116, (4000).to_bytes(4, "little"), 0.0)
    there = servo.setpoint(250_000)
    assert there == servo.setpoint(3e6) < 100
    assert servo.get("bus_watchdog") == -1
    assert servo.write(116, bytes(4), 3e6) == 4  # closed until the watchdog is cleared
    assert servo.write(98, bytes(1), 3e6) == 0
    assert servo.write(116, bytes(4), 3e6) == 0
