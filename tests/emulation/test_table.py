"""The emulated control table against ROBOTIS's e-manual, entry by entry, through its SDK."""

import pytest
from dynamixel_sdk import COMM_SUCCESS, PacketHandler
from tests.emulation.port import Port

from miburi.emulation.bus import Bus
from miburi.emulation.control_table import REGISTERS, SIZE
from miburi.emulation.servos import Servo

SDK = PacketHandler(2.0)

#: What the e-manual's page of the XL330-M288-T says of each entry: address, bytes, access, initial
#: value, range; "-" where it says nothing. The range of a goal is a limit's.
MANUAL = """
    0 2 R 1200 - -
    2 4 R - - -
    6 1 R - - -
    7 1 RW 1 0 252
    8 1 RW 1 0 6
    9 1 RW 250 0 254
    10 1 RW 0 0 13
    11 1 RW 3 0 16
    12 1 RW 255 0 252
    13 1 RW 2 2 22
    20 4 RW 0 -1044479 1044479
    24 4 RW 10 0 1023
    31 1 RW 70 0 100
    32 2 RW 70 31 70
    34 2 RW 35 31 70
    36 2 RW 885 0 885
    38 2 RW 1750 0 1750
    44 4 RW 445 0 2047
    48 4 RW 4095 0 4095
    52 4 RW 0 0 4095
    60 1 RW 0 0 3
    62 1 RW 140 1 255
    63 1 RW 53 - -
    64 1 RW 0 0 1
    65 1 RW 0 0 1
    68 1 RW 2 0 2
    69 1 R 0 - -
    70 1 R 0 - -
    76 2 RW 1600 0 16383
    78 2 RW 180 0 16383
    80 2 RW 0 0 16383
    82 2 RW 0 0 16383
    84 2 RW 400 0 16383
    88 2 RW 0 0 16383
    90 2 RW 0 0 16383
    98 1 RW 0 0 127
    100 2 RW - -885 885
    102 2 RW - -1750 1750
    104 4 RW - -445 445
    108 4 RW 0 0 32767
    112 4 RW 0 0 32767
    116 4 RW - 0 4095
    120 2 R - - -
    122 1 R 0 - -
    123 1 R 0 - -
    124 2 R - - -
    126 2 R - - -
    128 4 R - - -
    132 4 R - - -
    136 4 R - - -
    140 4 R - - -
    144 2 R - - -
    146 1 R - - -
    147 1 R - - -
"""
LINES = [
    *MANUAL.strip().splitlines(),
    *[f"{168 + 2 * i} 2 RW {208 + i} 64 227" for i in range(20)],
    *[f"{208 + i} 1 RW 0 0 255" for i in range(20)],
]
#: Where we differ, and why: the secondary id's own default is beyond its range, and 253 to 255
#: switch it off; of the modes and the protocols, only some in their ranges exist.
BEYOND = {12: 255}
MODES = {11: (0, 1, 3, 4, 5, 16), 13: (2, 20, 21, 22)}


@pytest.fixture
def port() -> Port:
    port = Port(Bus([Servo.new(1)]))
    port.bus.servos[0].set("baud", 1)
    port.baud = 57_600
    return port


def test_it_has_the_manuals_entries_and_no_other() -> None:
    ours = sorted((entry.address, entry.size, entry.writable) for entry in REGISTERS.values())
    fields = [line.split() for line in LINES]
    theirs = sorted((int(at), int(size), access == "RW") for at, size, access, *_ in fields)
    assert ours == theirs
    assert SIZE == 228


@pytest.mark.parametrize("line", LINES, ids=lambda line: line.split()[0])
def test_an_entry_is_the_manuals(port: Port, line: str) -> None:
    """Its value from the factory, its access, the ends of its range and what is just beyond."""
    at, size, access, initial, *ends = line.split()
    address, count = int(at), int(size)

    def take(wanted: int) -> int:
        data = list((wanted % (1 << 8 * count)).to_bytes(count, "little"))
        result, error = SDK.writeTxRx(port, 1, address, count, data)
        assert result == COMM_SUCCESS
        # What changes by whom and how it is heard is asked for anew.
        for name, value in {"id": 1, "baud": 1, "status_return_level": 2}.items():
            port.bus.servos[0].set(name, value)
        return int(error) & 0x7F  # beyond a limit that was just written it shuts down

    data, result, error = SDK.readTxRx(port, 1, address, count)
    assert (result, error) == (COMM_SUCCESS, 0)
    if initial != "-":
        assert int.from_bytes(bytes(data), "little") == int(initial)
    if access == "R":
        assert take(0) == 7
        return
    if count > 1:
        half = SDK.writeTxRx(port, 1, address, count - 1, [0] * (count - 1))
        assert half == (COMM_SUCCESS, 5)
    if "-" in ends:
        return
    low, high = int(ends[0]), BEYOND.get(address, int(ends[1]))
    exist = MODES.get(address, (low, high))
    assert [take(value) for value in exist] == [0] * len(exist)
    far = 1 << (8 * count - 1)
    for value in (low - 1, high + 1):
        # What does not fit into its bytes cannot be asked for.
        if (-far if low < 0 else 0) <= value < (far if low < 0 else 2 * far):
            limited = 6 if address in (100, 102, 104, 116) else 4
            assert take(value) in (limited, 4)


def test_the_eeprom_is_locked_while_torque_is_on(port: Port) -> None:
    port.bus.servos[0].set("goal_position", 2048)
    assert SDK.write1ByteTxRx(port, 1, 64, 1) == (COMM_SUCCESS, 0)
    for name, entry in REGISTERS.items():
        if entry.writable:
            data = [0] * entry.size
            data[0] = port.bus.servos[0].get(name) & 0xFF
            error = SDK.writeTxRx(port, 1, entry.address, entry.size, data)[1]
            assert (error == 7) == (entry.address < 64), name
