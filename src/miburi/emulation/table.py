"""One servo's control table: its values, and the writes that it takes."""

from dataclasses import dataclass, field
from struct import Struct

from miburi.emulation.control_table import EEPROM_END, REGISTERS, SIZE, Register
from miburi.servos import Servo as Model

#: Errors of a status packet (protocol 2.0).
RANGE_ERROR, _LENGTH_ERROR, _LIMIT_ERROR, ACCESS_ERROR = 0x04, 0x05, 0x06, 0x07
#: The operating modes; and position control, whose goals stay within one turn.
_MODES, POSITION = (0, 1, 3, 4, 5, 16), 3
#: The registers that a change of the mode resets.
_OF_MODE = (
    "position_d_gain", "position_i_gain", "position_p_gain", "feedforward_2nd_gain",
    "feedforward_1st_gain", "profile_speed", "profile_acceleration",
)  # fmt: skip
#: The registers that a servo fills in when they are read. Other read-only registers keep
#: their factory values, because nothing here reads them.
_MEASURED = {"pwm", "current", "speed", "position", "position_trajectory"}
#: The signed registers: measurements, and the watchdog, which reads −1 once it has tripped.
_SIGNED = {"bus_watchdog", *_MEASURED}
_FORMATS = {1: "b", 2: "h", 4: "i"}
#: The function that unpacks each register, and the register's address.
_READERS = {
    name: (Struct("<" + (form if at.low < 0 or name in _SIGNED else form.upper())).unpack_from,
           at.address)
    for name, at in REGISTERS.items()
    for form in [_FORMATS[at.size]]
}  # fmt: skip
#: The register at each defined address.
_AT = {
    address: name
    for name, register in REGISTERS.items()
    for address in range(register.address, register.address + register.size)
}


@dataclass
class ControlTable:
    """The bytes of a control table; it starts with the factory's values for one kind of servo."""

    model: Model
    data: bytearray = field(default_factory=lambda: bytearray(SIZE))
    #: The number of changes so far; until it grows, values that were looked up remain valid.
    changes: int = 0
    _decoded: dict[str, int] = field(default_factory=dict)  # entries read since they changed

    def __post_init__(self) -> None:
        for name in REGISTERS:
            self.set(name, self._default(name))

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

    def write(self, address: int, data: bytes) -> None:
        """Set bytes from ``address`` on, bypassing all protection."""
        self.data[address : address + len(data)] = data
        self.changes += 1
        for name in self._names(address, len(data)):
            self._decoded.pop(name, None)

    def forget(self) -> None:
        """Reset all that does not survive a loss of power."""
        for name, register in REGISTERS.items():
            if register.address >= EEPROM_END:
                self.set(name, self._default(name))
        self._limit_goals()

    def change_mode(self) -> None:
        """Reset gains, profile, goal PWM and goal current, as a change of mode does."""
        for name in _OF_MODE:
            self.set(name, self._default(name))
        self._limit_goals()

    def _limit_goals(self) -> None:
        for goal, limit in (("goal_pwm", "pwm_limit"), ("goal_current", "current_limit")):
            self.set(goal, self.get(limit))

    def _default(self, name: str) -> int:
        gains = {"position_p_gain": self.model.gains.p, "position_d_gain": self.model.gains.d}
        return round(gains.get(name, REGISTERS[name].default))

    def measured(self, address: int, count: int) -> list[str]:
        """Return which of the registers at these addresses a servo fills in when they are read."""
        return [name for name in self._names(address, count) if name in _MEASURED]

    def readable(self, address: int, count: int) -> bool:
        """Return whether a read begins and ends at defined addresses; gaps read as 0 (ours)."""
        return count > 0 and address in _AT and address + count - 1 in _AT

    def refusal(self, address: int, data: bytes) -> int:
        """Return the error with which the servo refuses a write; 0 if it takes it."""
        end, known = address + len(data), 0
        for name in self._names(address, len(data)):
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

    def _names(self, address: int, count: int) -> list[str]:
        places = range(address, address + count)
        return list(dict.fromkeys(_AT[at] for at in places if at in _AT))

    def _refused_value(self, name: str, at: Register, value: int) -> int:
        if not at.low <= value <= at.high or (name == "operating_mode" and value not in _MODES):
            return RANGE_ERROR
        if at.limit and abs(value) > self.get(at.limit):
            return _LIMIT_ERROR
        if name == "goal_position" and self.get("operating_mode") == POSITION:
            least, most = self.get("min_position_limit"), self.get("max_position_limit")
            return 0 if least <= value <= most else _LIMIT_ERROR
        # After a shutdown, only a reboot gives torque back.
        shut = name == "torque_enable" and value and self.get("hardware_error")
        return ACCESS_ERROR if shut else 0
