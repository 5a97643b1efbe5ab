"""Eight DYNAMIXEL XL330 in Python: what a card's servo bus sees when no servo is there.

They follow speed profiles as the XL330's manual describes them, and can be blocked, loaded, dead,
deaf, hot, slow to answer, and unplugged. :class:`miburi.emulation.bus.Bus` is their wire.

Times are µs on the card's clock; positions are the servo's own steps, as floats until read.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import sqrt
from struct import Struct

from miburi.emulation.control import FULL, Control, PidGains
from miburi.emulation.control_table import EEPROM_END, REGISTERS, SIZE, Register
from miburi.servos import Servo as Model
from miburi.servos import load_servo

__all__ = [
    "ACCELERATION_UNIT",
    "INSTRUCTION_ERROR",
    "MODEL",
    "SPEED_UNIT",
    "Segment",
    "Servo",
    "Shaft",
]

MODEL = 1200
#: Errors of a status packet (protocol 2.0).
INSTRUCTION_ERROR, _RANGE_ERROR, _LENGTH_ERROR = 0x02, 0x04, 0x05
_LIMIT_ERROR, _ACCESS_ERROR = 0x06, 0x07
#: Operating modes that exist, and those in which goals are places within one turn, or many.
_MODES, _POSITION, _TURNS = (0, 1, 3, 4, 5, 16), 3, 1_048_575
_CURRENT_AND_POSITION, _PWM = 5, 16
_ALERT = 0x80
#: The position control's gains, in the order of the table.
_GAINS = (
    "position_d_gain",
    "position_i_gain",
    "position_p_gain",
    "feedforward_2nd_gain",
    "feedforward_1st_gain",
)
_GAINS_BYTES, _GAINS_AT = Struct("<3H2x2H"), REGISTERS[_GAINS[0]].address
#: Read-only registers that count to both sides of 0, and the watchdog, which says −1 when it bit.
_SIGNED = ("bus_watchdog", "pwm", "current", "speed", "position", "velocity_trajectory")
#: What one unit of the servo's speed and acceleration is, in steps/s and steps/s².
SPEED_UNIT = 0.229 * 4096 / 60
ACCELERATION_UNIT = 214.577 * 4096 / 3600


@dataclass(frozen=True)
class Segment:
    """A stretch of the servo's trajectory: from rest at ``origin`` to rest at ``goal``."""

    began: float
    origin: float
    goal: float
    speed: float  # steps/s; 0 for at once
    acceleration: float  # steps/s²; 0 for at once

    def at(self, time: float) -> float:
        """Where the trajectory is at ``time``, in steps."""
        t = (time - self.began) / 1e6
        way = abs(self.goal - self.origin)
        if t <= 0:
            return self.origin
        if self.speed == 0 or way == 0:
            return self.goal
        ramp = self.speed / self.acceleration if self.acceleration else 0.0
        if self.acceleration and self.speed * ramp > way:
            ramp = sqrt(way / self.acceleration)
        top = self.acceleration * ramp if self.acceleration else self.speed
        total = way / top + ramp
        if t >= total:
            return self.goal
        if t < ramp:
            done = self.acceleration * t * t / 2
        elif t > total - ramp:
            done = way - self.acceleration * (total - t) ** 2 / 2
        else:
            done = top * (t - ramp / 2)
        return self.origin + done * (1 if self.goal > self.origin else -1)


class Shaft:
    """What a servo turns when there is no physics: it follows its trajectory with a lag.

    Attributes
    ----------
    lag
        µs.
    load
        Steps by which it stays behind while torque is on.
    low, high
        Steps that it cannot pass: set either to block the joint.
    noise
        Gives a reading's error in steps, at each reading.
    """

    def __init__(self, position: float = 2048.0, lag: float = 30_000.0) -> None:
        self.place, self.lag, self.load = position, lag, 0.0
        self.low, self.high = float("-inf"), float("inf")
        self.noise: Callable[[], float] = lambda: 0.0
        self._before: Segment | None = None

    def position(self, servo: "Servo", time: float) -> float:
        """Where the shaft is at ``time``, in steps."""
        if servo.segment is not None:
            past = time - self.lag
            segment = servo.segment
            if past < segment.began and servo.before is not None:
                segment = servo.before
            self.place = segment.at(past) + self.load
        self.place = min(max(self.place, self.low), self.high)
        return self.place

    def speed(self, servo: "Servo", time: float) -> float:
        """How fast it turns, over the latest 10 ms, in steps/s."""
        before = self.position(servo, time - 10_000)
        return (self.position(servo, time) - before) * 100


@dataclass
class Servo:
    """One servo: its control table, its trajectory and its faults.

    Attributes
    ----------
    model
        The constants of its motor and control.
    start_delay, clock
        µs from an order to its trajectory's start, and how fast its clock is.
    dead
        Unplugged, or without power: hears and says nothing.
    deaf
        Answers, but takes no orders.
    delay
        Extra µs before each answer.
    lie
        Turns the place where the shaft is into what is read, both in steps.
    alias
        The id with which it answers, where that is another's.
    segment, before
        The trajectory, None with torque off; and the one before it.
    """

    shaft: Shaft
    model: Model
    table: bytearray = field(default_factory=lambda: bytearray(SIZE))
    start_delay: float = 0.0
    clock: float = 1.0
    dead: bool = False
    deaf: bool = False
    delay: float = 0.0
    lie: Callable[[int], int] = lambda place: place
    alias: int | None = None
    segment: Segment | None = None
    before: Segment | None = None
    _heard: float = 0.0

    def __post_init__(self) -> None:
        self.control = Control(self.model)

    @classmethod
    def new(
        cls,
        servo: int,
        position: float = 2048.0,
        shaft: Shaft | None = None,
        model: Model | None = None,
    ) -> "Servo":
        """Return a servo that has been given an id, and is otherwise as from the factory.

        ``model`` is by default the identified XL330.
        """
        made = cls(shaft or Shaft(position), model or load_servo("xl330-m288-t"))
        for name in REGISTERS:
            made.set(name, made._default(name))
        made.set("id", servo)
        made.set("baud", 3)
        return made

    def _default(self, name: str) -> int:
        """Return what stands in a register after the factory, or with the power."""
        gains = {"position_p_gain": self.model.gains.p, "position_d_gain": self.model.gains.d}
        return round(gains.get(name, REGISTERS[name].default))

    def get(self, name: str) -> int:
        """Return an entry of the control table."""
        at = REGISTERS[name]
        signed = at.low < 0 or name in _SIGNED
        data = self.table[at.address : at.address + at.size]
        return int.from_bytes(data, "little", signed=signed)

    def set(self, name: str, value: int) -> None:
        """Set an entry of the control table, past all protection."""
        at = REGISTERS[name]
        data = (value % (1 << 8 * at.size)).to_bytes(at.size, "little")
        self.table[at.address : at.address + at.size] = data

    def power_up(self) -> None:
        """Forget all but the EEPROM, as after a loss of power."""
        for name, register in REGISTERS.items():
            if register.address >= EEPROM_END:
                self.set(name, self._default(name))
        self._limit_goals()
        self.segment = self.before = None

    def _limit_goals(self) -> None:
        for goal, limit in (("goal_pwm", "pwm_limit"), ("goal_current", "current_limit")):
            self.set(goal, self.get(limit))

    def drive(self, time: float, place: float, speed: float) -> float | None:
        """Return the motor's duty, −1 to 1, at a turn of the control; None with torque off.

        ``place`` is where the shaft is, in steps; ``speed`` its speed, in steps/s.
        """
        goal = self.setpoint(time)
        if goal is None or self.segment is None:
            self.control.rest()
            return None
        mode = self.get("operating_mode")
        ceiling = self.get("goal_pwm")
        most: float = min(abs(ceiling), self.get("pwm_limit"))
        if mode == _PWM:
            pwm = min(max(ceiling, -most), most)
        else:
            if mode == _CURRENT_AND_POSITION:
                share = abs(self.get("goal_current")) / 1e3 / self.model.data_sheet.stall_current
                most = min(most, share * FULL)
            gains = PidGains(*_GAINS_BYTES.unpack_from(self.table, _GAINS_AT))
            before = self.segment.at(time - 1e6 / self.model.loop.rate)
            wanted = (goal - before) * self.model.loop.rate
            pwm = self.control.follow(gains, goal - round(place), speed, wanted, most)
        return self.control.set_pwm(pwm, self.get("pwm_slope"))

    def setpoint(self, time: float) -> float | None:
        """Where the servo wants its shaft at ``time``, in steps; None with torque off."""
        self._check_watchdog(time)
        segment = self.segment
        if segment is not None and self.before is not None and time < segment.began:
            segment = self.before
        return None if segment is None else segment.at(time)

    def heard(self, time: float) -> None:
        """Note that some packet was on the bus."""
        self._check_watchdog(time)
        self._heard = time

    def read(self, address: int, count: int, time: float) -> tuple[int, bytes]:
        """Return the error and the bytes of the control table."""
        if address + count > SIZE:
            return self._error(_RANGE_ERROR), b""
        self.set("speed", round(self.shaft.speed(self, time) / SPEED_UNIT))
        place = round(self.shaft.position(self, time) + self.shaft.noise())
        self.set("position", self.lie(place))
        return self._error(0), bytes(self.table[address : address + count])

    def write(self, address: int, data: bytes, time: float) -> int:
        """Write to the control table; return the error."""
        end = address + len(data)
        goals = REGISTERS["goal_pwm"].address < end and address < REGISTERS["realtime_tick"].address
        error = self._refusal(address, data)
        if not error and goals and self.get("bus_watchdog") == -1:
            error = _RANGE_ERROR
        if error:
            return self._error(error)
        if self.deaf:
            return self._error(0)
        self.shaft.position(self, time)  # what follows from the write begins now
        torque = REGISTERS["torque_enable"].address
        if address <= torque < end:
            self._set_torque(bool(data[torque - address]), time)
        mode = self.get("operating_mode")
        self.table[address:end] = data
        if self.get("operating_mode") != mode:
            self._change_mode()
        if goals and end > REGISTERS["goal_position"].address and self.segment is not None:
            self._go(time)
        return self._error(0)

    def _change_mode(self) -> None:
        """Set gains, profile and limits back, as the manual says of another operating mode."""
        for name in (*_GAINS, "profile_speed", "profile_acceleration"):
            self.set(name, self._default(name))
        self._limit_goals()

    def _refusal(self, address: int, data: bytes) -> int:
        """Return the error for which the servo does not take a write; 0 if it does."""
        end, known = address + len(data), 0
        for name, at in REGISTERS.items():
            last = at.address + at.size
            if last <= address or end <= at.address:
                continue
            known += at.size
            if not at.writable or (at.address < EEPROM_END and self.get("torque_enable")):
                return _ACCESS_ERROR
            if at.address < address or end < last:
                return _LENGTH_ERROR
            start = at.address - address
            value = int.from_bytes(data[start : start + at.size], "little", signed=at.low < 0)
            error = self._refused_value(name, at, value)
            if error:
                return error
        return 0 if known == len(data) else _ACCESS_ERROR

    def _refused_value(self, name: str, at: Register, value: int) -> int:
        if not at.low <= value <= at.high or (name == "operating_mode" and value not in _MODES):
            return _RANGE_ERROR
        if at.limit and abs(value) > self.get(at.limit):
            return _LIMIT_ERROR
        if name == "goal_position" and not self._may_go_to(value):
            return _LIMIT_ERROR
        # After a shutdown, only a reboot gives torque back.
        shut = name == "torque_enable" and value and self.get("hardware_error")
        return _ACCESS_ERROR if shut else 0

    def _may_go_to(self, goal: int) -> bool:
        if self.get("operating_mode") == _POSITION:
            return self.get("min_position_limit") <= goal <= self.get("max_position_limit")
        return abs(goal) <= _TURNS

    def fail(self, error: int) -> None:
        """Report a hardware error (4 overheating, 32 overload, …) and take torque off."""
        self.set("hardware_error", error)
        self.set("torque_enable", 0)
        self.segment = self.before = None

    def _go(self, time: float) -> None:
        assert self.segment is not None  # noqa: S101  (only a servo with torque goes anywhere)
        self.before = self.segment
        began = time + self.start_delay
        self.segment = Segment(
            began,
            self.segment.at(began),
            self.get("goal_position"),
            self.get("profile_speed") * SPEED_UNIT * self.clock,
            self.get("profile_acceleration") * ACCELERATION_UNIT * self.clock**2,
        )

    def _set_torque(self, on: bool, time: float) -> None:
        on = on and not self.get("hardware_error")
        if on and self.segment is None:
            place = self.shaft.position(self, time)
            # Torque on pulls towards the goal that stands in the table, at once.
            self.segment = Segment(time, place, self.get("goal_position"), 0.0, 0.0)
            self.before = Segment(time - 1e6, place, place, 0.0, 0.0)
        elif not on:
            self.shaft.position(self, time)
            self.segment = self.before = None

    def _check_watchdog(self, time: float) -> None:
        patience = self.get("bus_watchdog") * 20_000
        if patience > 0 and time - self._heard > patience:
            self.set("bus_watchdog", -1)
            if self.segment is not None:
                tripped = self._heard + patience
                here = self.segment.at(tripped)
                self.before = self.segment
                self.segment = Segment(tripped, here, here, 0.0, 0.0)

    def _error(self, error: int) -> int:
        return error | (_ALERT if self.get("hardware_error") else 0)
