"""All of protocol 2.0 that a servo of ROBOTIS answers: the official SDK is the judge."""

import pytest
from dynamixel_sdk import (
    COMM_RX_CORRUPT,
    COMM_RX_TIMEOUT,
    COMM_SUCCESS,
    GroupBulkRead,
    GroupBulkWrite,
    GroupSyncRead,
    PacketHandler,
)
from hypothesis import example, given
from hypothesis import strategies as st
from tests.emulation.port import Port

from miburi.emulation.bus import BAUDS, Bus
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
    SYNC_READ,
    SYNC_WRITE,
    WRITE,
    packet,
    packets,
)
from miburi.emulation.servos import MODEL, Servo, Shaft

SDK = PacketHandler(2.0)
#: Registers.
ID, BAUD, DRIVE, MODE, SECONDARY, HOMING, THRESHOLD, TORQUE = 7, 8, 10, 11, 12, 20, 24, 64
LED, REGISTERED, GAIN, ACCELERATION, SPEED, GOAL, TICK = 65, 69, 84, 108, 112, 116, 120
MOVING, STATUS, POSITION, TRAJECTORY_SPEED, TRAJECTORY, INDIRECT = 122, 123, 132, 136, 140, 168
FAILED, UNDEFINED_INSTRUCTION, RANGE, ACCESS = 1, 2, 4, 7
INSTRUCTIONS = (
    PING, READ, WRITE, REG_WRITE, ACTION, FACTORY_RESET, REBOOT, CLEAR, SYNC_READ, SYNC_WRITE,
    FAST_SYNC_READ, BULK_READ, BULK_WRITE, FAST_BULK_READ,
)  # fmt: skip
#: Parameters that a host might send: reads, writes and their groups, a reset, a clear.
USUAL = (
    bytes((132, 0, 4, 0)), bytes((64, 0, 1)), bytes((116, 0, 0, 8, 0, 0)), bytes((11, 0, 16)),
    bytes((10, 0, 13)), bytes((100, 0, 3, 0)), bytes((7, 0, 2)), bytes((8, 0, 1)), b"\xff", b"\1",
    bytes((132, 0, 4, 0, 1, 2, 3)), bytes((116, 0, 4, 0, 1, 0, 8, 0, 0)), b"\1\x44\x58\x4c\x22",
    bytes((1, 132, 0, 4, 0, 2, 64, 0, 1, 0)), bytes((1, 64, 0, 1, 0, 1)),
    bytes((112, 0, 50, 0, 0, 0)),
)  # fmt: skip


def little(value: int, size: int) -> list[int]:
    return list((value % (1 << 8 * size)).to_bytes(size, "little"))


@pytest.fixture
def port() -> Port:
    return Port(Bus([Servo.new(i, 2000.0 + i) for i in range(1, 9)]))


@pytest.fixture
def servo(port: Port) -> Servo:
    return port.bus.servos[0]


def write(port: Port, address: int, value: int, size: int = 1, error: int = 0) -> None:
    said = SDK.writeTxRx(port, 1, address, size, little(value, size))
    assert said == (COMM_SUCCESS, error)


def read(port: Port, address: int, size: int = 1) -> int:
    data, result, error = SDK.readTxRx(port, 1, address, size)
    assert (result, error) == (COMM_SUCCESS, 0)
    return int.from_bytes(bytes(data), "little", signed=size == 4)


def test_a_ping_of_all_finds_all(port: Port) -> None:
    found, result = SDK.broadcastPing(port)
    assert result == COMM_SUCCESS
    assert found == {i: [MODEL, 46] for i in range(1, 9)}


def test_a_bulk_read_reads_from_each_what_it_is_asked_for(port: Port) -> None:
    """What the official example reads: a position here, an LED there."""
    group = GroupBulkRead(port, SDK)
    group.addParam(1, POSITION, 4)
    group.addParam(2, LED, 1)
    port.bus.servos[1].set("led", 1)
    for way in (group.txRxPacket, group.fastBulkRead):
        assert way() == COMM_SUCCESS
        assert group.getData(1, POSITION, 4) == 2001
        assert group.getData(2, LED, 1) == 1


def test_a_fast_sync_read_is_one_packet(port: Port) -> None:
    group = GroupSyncRead(port, SDK, POSITION, 4)
    for servo in range(1, 9):
        group.addParam(servo)
    assert group.fastSyncRead() == COMM_SUCCESS
    assert [group.getData(i, POSITION, 4) for i in range(1, 9)] == [2000 + i for i in range(1, 9)]
    # The one packet stays torn where a servo is missing.
    port.bus.servos[4].dead = True
    assert group.fastSyncRead() == COMM_RX_CORRUPT


def test_a_fast_read_is_as_long_as_the_manuals_example() -> None:
    """Three servos, 4 bytes each: the header says 25, and every block ends with a checksum."""
    bus = Bus([Servo.new(i) for i in (3, 7, 4)])
    asked = packet(BROADCAST, FAST_SYNC_READ, bytes((POSITION, 0, 4, 0, 3, 7, 4)))
    said = bus.answer(asked, 1000.0)
    whole = b"".join(block for _, block in said)
    assert whole[:8] == bytes([0xFF, 0xFF, 0xFD, 0x00, 0xFE, 25, 0x00, 0x55])
    assert [len(block) for _, block in said] == [16, 8, 8]
    assert [whole[9], whole[17], whole[25]] == [3, 7, 4]


def test_a_bulk_write_writes_to_each_what_it_is_told(port: Port) -> None:
    group = GroupBulkWrite(port, SDK)
    group.addParam(1, GAIN, 2, little(3200, 2))
    group.addParam(2, LED, 1, [1])
    assert group.txPacket() == COMM_SUCCESS
    assert [port.bus.servos[0].get("position_p_gain"), port.bus.servos[1].get("led")] == [3200, 1]


def test_a_registered_write_waits_for_its_action(port: Port) -> None:
    assert SDK.regWriteTxRx(port, 1, LED, 1, [1]) == (COMM_SUCCESS, 0)
    assert SDK.regWriteTxRx(port, 2, LED, 1, [1]) == (COMM_SUCCESS, 0)
    assert (read(port, LED), read(port, REGISTERED)) == (0, 1)
    SDK.action(port, 0xFE)
    assert [one.get("led") for one in port.bus.servos[:3]] == [1, 1, 0]
    assert read(port, REGISTERED) == 0
    assert SDK.regWriteTxRx(port, 1, LED, 1, [2]) == (COMM_SUCCESS, RANGE)
    assert port.bus.servos[0].act(port.time) == UNDEFINED_INSTRUCTION  # nothing was registered
    SDK.regWriteTxRx(port, 1, LED, 1, [0])
    SDK.reboot(port, 1)
    assert read(port, REGISTERED) == 0


@pytest.mark.parametrize(
    ("option", "left"), [(0xFF, (1, 1, 250)), (0x01, (7, 1, 250)), (0x02, (7, 3, 250))]
)
def test_a_factory_reset_keeps_what_its_option_says(option: int, left: tuple[int, ...]) -> None:
    servo = Servo.new(7)
    port = Port(Bus([servo]))
    for name, value in {"return_delay": 25, "homing_offset": 9, "position_p_gain": 3200}.items():
        servo.set(name, value)
    # The answer comes under the id and at the speed that it still had.
    assert SDK.factoryReset(port, 7, option) == (COMM_SUCCESS, 0)
    assert tuple(servo.get(name) for name in ("id", "baud", "return_delay")) == left
    assert (servo.get("homing_offset"), servo.get("position_p_gain")) == (0, 400)
    port.baud = BAUDS[left[1]]
    assert SDK.ping(port, left[0])[1] == COMM_SUCCESS


def test_no_factory_reset_of_all_at_once(port: Port) -> None:
    SDK.factoryReset(port, 0xFE, 0xFF)
    assert [one.get("id") for one in port.bus.servos] == list(range(1, 9))
    assert SDK.factoryReset(port, 1, 0x03) == (COMM_SUCCESS, RANGE)


def test_clear_forgets_whole_turns_at_rest_alone(port: Port, servo: Servo) -> None:
    write(port, MODE, 4)
    servo.shaft.place = 3 * 4096 + 100
    assert read(port, POSITION, 4) == 3 * 4096 + 100
    assert SDK.clearMultiTurn(port, 1) == (COMM_SUCCESS, 0)
    assert read(port, POSITION, 4) == 100
    write(port, SPEED, 50, 4)
    servo.set("goal_position", 100)
    write(port, TORQUE, 1)
    write(port, GOAL, 5000, 4)
    port.time += 300_000
    assert SDK.clearMultiTurn(port, 1) == (COMM_SUCCESS, FAILED)
    # Its goals count from there, too.
    port.time += 9e6
    assert read(port, POSITION, 4) == 5000
    assert servo.shaft.place == 3 * 4096 + 5000


@pytest.mark.parametrize("how", ["reboot", "mode", "torque"])
def test_whole_turns_are_forgotten_where_the_manual_says(
    port: Port, servo: Servo, how: str
) -> None:
    """At a start, with position control, and with torque in it: a limp joint across the seam."""
    if how == "mode":
        write(port, MODE, 4)
    servo.shaft.place = -10.0
    assert read(port, POSITION, 4) == -10
    if how == "reboot":
        SDK.reboot(port, 1)
    elif how == "mode":
        write(port, MODE, 3)
    else:
        write(port, GOAL, 4086, 4)
        write(port, TORQUE, 1)
    assert read(port, POSITION, 4) == 4086
    assert servo.shaft.place == -10


@pytest.mark.parametrize(
    ("offset", "mode", "counts"), [(500, 3, 500), (1024, 3, 1024), (1025, 3, 0), (5000, 4, 5000)]
)
def test_a_homing_offset_is_added_to_positions_and_goals(
    port: Port, servo: Servo, offset: int, mode: int, counts: int
) -> None:
    """In position control no more than 1024 of it, as the manual says."""
    write(port, MODE, mode)
    write(port, HOMING, offset, 4)
    assert read(port, POSITION, 4) == 2001 + counts
    servo.set("goal_position", 2001 + counts)
    write(port, TORQUE, 1)
    port.time += 1e5
    assert read(port, POSITION, 4) == 2001 + counts
    write(port, GOAL, 2101 + counts, 4)
    port.time += 1e5
    assert servo.shaft.position(servo, port.time) == 2101


def test_in_reverse_it_turns_and_counts_the_other_way(port: Port, servo: Servo) -> None:
    write(port, MODE, 4)
    write(port, DRIVE, 1)
    write(port, HOMING, 10, 4)
    assert read(port, POSITION, 4) == -2001 + 10  # the offset keeps its sign
    servo.set("goal_position", -1991)
    write(port, TORQUE, 1)
    write(port, GOAL, -1891, 4)
    port.time += 1e5
    assert servo.shaft.position(servo, port.time) == 2001 - 100


def test_a_profile_of_time_takes_its_time(port: Port, servo: Servo) -> None:
    write(port, DRIVE, 4)
    servo.shaft.lag = 0.0
    servo.set("goal_position", 2001)
    write(port, TORQUE, 1)
    write(port, ACCELERATION, 200, 4)
    write(port, SPEED, 1000, 4)
    write(port, GOAL, 3001, 4)
    began = port.time
    ways = [servo.setpoint(began + ms * 1000) for ms in (0, 200, 500, 800, 999, 1000)]
    assert ways[0] == 2001
    assert ways[1] == pytest.approx(2001 + 125)
    assert ways[2] == pytest.approx(2501)
    assert ways[3] == pytest.approx(3001 - 125)
    assert ways[4] < ways[5] == 3001


def test_a_goal_may_switch_torque_on(port: Port, servo: Servo) -> None:
    write(port, GOAL, 2101, 4)
    assert servo.get("torque_enable") == 0
    write(port, DRIVE, 8)
    write(port, GOAL, 2101, 4)
    assert read(port, TORQUE) == 1
    port.time += 1e5
    assert read(port, POSITION, 4) == 2101


@pytest.mark.parametrize(
    ("acceleration", "speed", "way", "kind"),
    [(0, 0, 500, 0x00), (0, 50, 500, 0x10), (20, 50, 20, 0x20), (20, 50, 500, 0x30)],
)
def test_moving_and_its_status_say_what_goes_on(
    port: Port, servo: Servo, acceleration: int, speed: int, way: int, kind: int
) -> None:
    servo.set("goal_position", 2001)
    write(port, TORQUE, 1)
    assert (read(port, MOVING), read(port, STATUS)) == (0, 0x01)
    write(port, ACCELERATION, acceleration, 4)
    write(port, SPEED, speed, 4)
    write(port, GOAL, 2001 + way, 4)
    port.time += 40_000
    if speed:
        assert read(port, STATUS) & 0x32 == kind | 0x02
        assert read(port, MOVING) == 1
        assert 2001 < read(port, TRAJECTORY, 4) < 2001 + way
        assert 0 < read(port, TRAJECTORY_SPEED, 4) <= speed
    port.time += 2e6
    assert (read(port, MOVING), read(port, STATUS)) == (0, kind | 0x01)
    assert (read(port, TRAJECTORY, 4), read(port, TRAJECTORY_SPEED, 4)) == (2001 + way, 0)


def test_moving_begins_above_the_threshold(port: Port, servo: Servo) -> None:
    """A limp shaft that a hand turns: 20 units are more than 10, and less than 30."""

    def turned(_servo: Servo, _time: float) -> float:
        return 20 * 0.229 * 4096 / 60

    servo.shaft.speed = turned  # type: ignore[method-assign]
    assert (read(port, 128, 4), read(port, MOVING)) == (20, 1)
    write(port, THRESHOLD, 30, 4)
    assert read(port, MOVING) == 0


def test_its_clock_wraps(port: Port) -> None:
    port.time = 32_766_000.0
    assert read(port, TICK, 2) == 32_767
    assert read(port, TICK, 2) == 0


def test_another_speed_is_taken_at_once(port: Port, servo: Servo) -> None:
    """The answer still comes at the old one, as the official example expects."""
    for number in range(7):
        write(port, BAUD, number)
        if BAUDS[number] != port.baud:
            assert SDK.ping(port, 1)[1] == COMM_RX_TIMEOUT
        port.baud = BAUDS[number]
        assert SDK.ping(port, 1)[1] == COMM_SUCCESS


def test_two_servos_with_one_id_spoil_each_others_answers(port: Port) -> None:
    port.bus.servos[1].set("id", 1)
    assert SDK.read4ByteTxRx(port, 1, POSITION)[1] == COMM_RX_CORRUPT
    group = GroupSyncRead(port, SDK, POSITION, 4)
    for servo in (3, 1, 4):
        group.addParam(servo)
    assert group.txRxPacket() != COMM_SUCCESS
    # Who says the same at the same time is understood: this hides the fault until they differ.
    assert SDK.write1ByteTxRx(port, 1, LED, 1) == (COMM_SUCCESS, 0)
    assert [one.get("led") for one in port.bus.servos[:2]] == [1, 1]


def test_a_secondary_id_moves_a_group_and_nobody_answers(port: Port) -> None:
    for one in port.bus.servos[:3]:
        one.set("secondary_id", 100)
    assert SDK.write1ByteTxRx(port, 100, LED, 1)[0] == COMM_RX_TIMEOUT
    SDK.write1ByteTxRx(port, 100, MODE, 5)
    assert [one.get("led") for one in port.bus.servos[:4]] == [1, 1, 1, 0]
    assert [one.get("operating_mode") for one in port.bus.servos[:4]] == [3, 3, 3, 3]


def test_indirect_data_stands_for_what_its_addresses_name(port: Port, servo: Servo) -> None:
    """The manual's two examples: an LED, and the four bytes of a goal."""
    write(port, INDIRECT, LED, 2)
    for byte in range(4):
        write(port, INDIRECT + 2 + 2 * byte, GOAL + byte, 2)
    write(port, 208, 1)
    assert read(port, LED) == read(port, 208) == 1
    write(port, 208, 2, error=RANGE)
    servo.set("goal_position", 2001)
    write(port, TORQUE, 1)
    write(port, 209, 1024, 4)
    assert read(port, GOAL, 4) == read(port, 209, 4) == 1024
    write(port, 209, 5000, 4, error=6)
    write(port, 213, 77)  # what leads nowhere is memory
    assert read(port, 213) == 77
    write(port, INDIRECT, 7, 2, error=RANGE)  # not into the EEPROM


@pytest.mark.parametrize(("address", "count"), [(14, 1), (150, 4), (66, 2), (13, 2), (226, 4)])
def test_nothing_is_read_where_nothing_is_defined(port: Port, address: int, count: int) -> None:
    _, result, error = SDK.readTxRx(port, 1, address, count)
    assert (result, error) == (COMM_SUCCESS, ACCESS)


@pytest.mark.parametrize(
    ("entry", "just", "beyond", "bit"),
    [("temperature", 70, 71, 4), ("voltage", 35, 34, 1), ("voltage", 70, 71, 1)],
)
def test_a_servo_shuts_down_beyond_its_limits_where_it_is_asked_to(
    port: Port, servo: Servo, entry: str, just: int, beyond: int, bit: int
) -> None:
    servo.set("goal_position", 2001)
    for value, asked, error in ((just, 53, 0), (beyond, 53 & ~bit, 0), (beyond, 53, bit)):
        servo.set(entry, 50)
        SDK.reboot(port, 1)
        write(port, 63, asked)
        servo.set("goal_position", 2001)
        write(port, TORQUE, 1)
        servo.set(entry, value)
        alert = 0x80 if error else 0
        assert SDK.read1ByteTxRx(port, 1, 70) == (error, COMM_SUCCESS, alert)
        assert SDK.read1ByteTxRx(port, 1, TORQUE) == (0 if error else 1, COMM_SUCCESS, alert)


def test_a_servo_may_have_torque_from_the_start(port: Port, servo: Servo) -> None:
    write(port, 60, 1)
    SDK.reboot(port, 1)
    port.time += 1e5
    assert (read(port, TORQUE), read(port, GOAL, 4), read(port, POSITION, 4)) == (1, 2001, 2001)


def test_an_instruction_that_does_not_exist_is_an_error(port: Port) -> None:
    unknown = [0, 0, 0, 0, 1, 3, 0, 0x44, 0, 0]
    _, result, error = SDK.txRxPacket(port, unknown)
    assert (result, error) == (COMM_SUCCESS, UNDEFINED_INSTRUCTION)


@given(
    orders=st.lists(
        st.tuples(
            st.sampled_from([1, 2, 3, 100, BROADCAST]),
            st.sampled_from(INSTRUCTIONS) | st.integers(0, 255),
            st.binary(max_size=24) | st.sampled_from(USUAL),
        ),
        min_size=1,
        max_size=12,
    )
)
@example(orders=[(100, WRITE, b"\xff")])
@example(orders=[(1, FAST_BULK_READ, bytes((1, 0, 0, 0x9C, 0x73, 2, 0, 0, 0xFF, 0xFF)))])
def test_whatever_is_said_to_them_they_answer_in_whole_packets_or_not_at_all(
    orders: list[tuple[int, int, bytes]],
) -> None:
    """Any instruction with any parameters; every second one is what a host might say."""
    servos = [Servo.new(i, shaft=Shaft(2000.0)) for i in (1, 2, 3)]
    servos[1].set("secondary_id", 100)
    bus, time = Bus(servos), 0.0
    for servo, instruction, parameters in orders:
        time += 20_000.0
        fast = instruction in (FAST_SYNC_READ, FAST_BULK_READ)
        said = bus.answer(packet(servo, instruction, parameters), time)
        assert all(start >= time for start, _ in said)
        if not fast and len({one.get("id") for one in servos}) == len(servos):
            whole, rest = packets(b"".join(data for _, data in said))
            assert (len(whole), rest) == (len(said), b"")
        for one in servos:
            one.drive(time, one.shaft.position(one, time), 0.0)
