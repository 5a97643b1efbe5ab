"""One servo's control table: its values, the writes it takes, and where indirect data leads."""

from dataclasses import dataclass, field
from itertools import groupby
from struct import Struct

from miburi.emulation.control_table import EEPROM_END, REGISTERS, SIZE, Register
from miburi.servos import Servo as Model

__all__ = ["ACCESS_ERROR", "GAINS", "RANGE_ERROR", "ControlTable"]

#: Errors of a status packet (protocol 2.0).
RANGE_ERROR, _LENGTH_ERROR, _LIMIT_ERROR, ACCESS_ERROR = 0x04, 0x05, 0x06, 0x07
#: The operating modes; the mode whose goals stay within one turn; the goal limit of the other
#: modes.
_MODES, _POSITION, _TURNS = (0, 1, 3, 4, 5, 16), 3, 1_048_575
#: Protocols that exist.
_PROTOCOLS = (2, 20, 21, 22)
#: The position control's gains, in the order of the table.
GAINS = (
    "position_d_gain",
    "position_i_gain",
    "position_p_gain",
    "feedforward_2nd_gain",
    "feedforward_1st_gain",
)
#: Read-only registers that are signed, and the watchdog, which reads −1 once it has tripped.
_SIGNED = (
    "bus_watchdog", "pwm", "current", "speed", "position", "velocity_trajectory",
    "position_trajectory",
)  # fmt: skip
_FORMATS = {1: "b", 2: "h", 4: "i"}
#: The function that unpacks each register, and the register's address.
_READERS = {
    name: (Struct("<" + (form if at.low < 0 or name in _SIGNED else form.upper())).unpack_from,
           at.address)
    for name, at in REGISTERS.items()
    for form in [_FORMATS[at.size]]
}  # fmt: skip
#: Where indirect data begins and ends.
_DATA, _DATA_END = REGISTERS["indirect_data_1"].address, SIZE
#: The register at each defined address.
_AT = {
    address: name
    for name, register in REGISTERS.items()
    for address in range(register.address, register.address + register.size)
}
#: The registers that a servo fills in when they are read.
_MEASURED = {
    "realtime_tick", "moving", "moving_status", "pwm", "current", "speed", "position",
    "velocity_trajectory", "position_trajectory",
}  # fmt: skip


@dataclass
class ControlTable:
    """The bytes of a control table; it starts with the factory's values for one kind of servo."""

    model: Model
    data: bytearray = field(default_factory=lambda: bytearray(SIZE))
    #: The number of changes so far; until it grows, values that were looked up remain valid.
    changes: int = 0
    _decoded: dict[str, int] = field(default_factory=dict)  # entries read since they changed

    def __post_init__(self) -> None:
        self.reset()

    def get(self, name: str) -> int:
        """Return an entry."""
        value = self._decoded.get(name)
        if value is None:
            read, address = _READERS[name]
            value = self._decoded[name] = read(self.data, address)[0]
        return value

    def set(self, name: str, value: int) -> None:
        """Set an entry, bypassing all protection."""
        at = REGISTERS[name]
        data = (value % (1 << 8 * at.size)).to_bytes(at.size, "little")
        if self.data[at.address : at.address + at.size] != data:
            self.data[at.address : at.address + at.size] = data
            self._decoded.pop(name, None)
            self.changes += 1

    def set_byte(self, address: int, byte: int) -> None:
        """Set one byte, bypassing all protection."""
        self.data[address] = byte
        self.changes += 1
        self._decoded.pop(_AT.get(address, ""), None)

    def reset(self, *keep: str) -> None:
        """Reset all entries to the factory's values, except those named in ``keep``."""
        for name in REGISTERS:
            if name not in keep:
                self.set(name, self._default(name))

    def forget(self) -> None:
        """Reset all that does not survive a loss of power."""
        for name, register in REGISTERS.items():
            if register.address >= EEPROM_END:
                self.set(name, self._default(name))
        self._limit_goals()

    def change_mode(self) -> None:
        """Reset gains, profile, goal PWM and goal current, as a change of mode does."""
        for name in (*GAINS, "profile_speed", "profile_acceleration"):
            self.set(name, self._default(name))
        self._limit_goals()

    def _limit_goals(self) -> None:
        for goal, limit in (("goal_pwm", "pwm_limit"), ("goal_current", "current_limit")):
            self.set(goal, self.get(limit))

    def _default(self, name: str) -> int:
        gains = {"position_p_gain": self.model.gains.p, "position_d_gain": self.model.gains.d}
        return round(gains.get(name, REGISTERS[name].default))

    def behind(self, address: int, count: int) -> list[int]:
        """Return the addresses of ``count`` bytes from ``address``, following indirect ones."""
        return [
            self.get(f"indirect_address_{at - _DATA + 1}") if _DATA <= at < _DATA_END else at
            for at in range(address, address + count)
        ]

    def measured(self, addresses: list[int]) -> list[str]:
        """Return the registers at these addresses that a servo fills in when they are read."""
        return [*dict.fromkeys(_AT[at] for at in addresses if _AT.get(at) in _MEASURED)]

    def unreadable(self, addresses: list[int]) -> bool:
        """Return whether a read begins or ends at an undefined address; gaps read as 0 (ours)."""
        return not (addresses and addresses[0] in _AT and addresses[-1] in _AT)

    def refusal(self, addresses: list[int], data: bytes) -> int:
        """Return the error with which the servo refuses a write; 0 if it takes it."""
        pairs = list(enumerate(addresses))
        # Indirect addresses may point to registers that are not adjacent; each run of adjacent ones
        # is one write.
        for _, run in groupby(pairs, key=lambda pair: pair[1] - pair[0]):
            places = list(run)
            own = bytes(data[index] for index, _ in places)
            error = self._refused_run(places[0][1], own)
            if error:
                return error
        return 0

    def _refused_run(self, address: int, data: bytes) -> int:
        end, known = address + len(data), 0
        for name in dict.fromkeys(_AT[at] for at in range(address, end) if at in _AT):
            at = REGISTERS[name]
            last = at.address + at.size
            known += at.size
            if not at.writable or (at.address < EEPROM_END and self.get("torque_enable")):
                return ACCESS_ERROR
            if at.address < address or end < last:
                return _LENGTH_ERROR
            start = at.address - address
            value = int.from_bytes(data[start : start + at.size], "little", signed=at.low < 0)
            error = self._refused_value(name, at, value)
            if error:
                return error
        return 0 if known == len(data) else ACCESS_ERROR

    def _refused_value(self, name: str, at: Register, value: int) -> int:
        exist = {"operating_mode": _MODES, "protocol": _PROTOCOLS}.get(name)
        if not at.low <= value <= at.high or (exist and value not in exist):
            return RANGE_ERROR
        if at.limit and abs(value) > self.get(at.limit):
            return _LIMIT_ERROR
        if name == "goal_position" and not self._may_go_to(value):
            return _LIMIT_ERROR
        # After a shutdown, only a reboot gives torque back.
        shut = name == "torque_enable" and value and self.get("hardware_error")
        return ACCESS_ERROR if shut else 0

    def _may_go_to(self, goal: int) -> bool:
        if self.get("operating_mode") == _POSITION:
            return self.get("min_position_limit") <= goal <= self.get("max_position_limit")
        return abs(goal) <= _TURNS
