"""DYNAMIXEL XL330 servos in Python: the devices on a card's servo bus when there are no real ones.

They follow speed profiles as the XL330's manual describes them, and can be blocked, loaded, dead,
deaf, hot, slow to answer, and unplugged. :class:`miburi.emulation.bus.Bus` is their wire.

Times are µs on the card's clock; positions are those of the shaft, in the servo's steps; they are
floats until a host reads them. Positions that a host reads and writes allow for turns, direction
and homing offset, as on the servo.
"""

from collections.abc import Callable
from dataclasses import dataclass

from miburi.emulation.control import FULL
from miburi.emulation.control_table import EEPROM_END, REGISTERS
from miburi.emulation.count import POSITION, TURN, Count
from miburi.emulation.drive import MotorDrive
from miburi.emulation.table import ACCESS_ERROR, RANGE_ERROR, ControlTable
from miburi.emulation.trajectory import Segment
from miburi.servos import Servo as Model
from miburi.servos import load_servo

__all__ = ["ACCELERATION_UNIT", "INSTRUCTION_ERROR", "MODEL", "SPEED_UNIT", "Servo", "Shaft"]

MODEL = 1200
_FAILED, INSTRUCTION_ERROR, _ALERT = 0x01, 0x02, 0x80
#: What one unit of the servo's speed and acceleration is, in steps/s and steps/s².
SPEED_UNIT = 0.229 * 4096 / 60
ACCELERATION_UNIT = 214.577 * 4096 / 3600
#: Bits of Drive Mode.
_IN_TIME, _TORQUE_BY_GOAL = 0x04, 0x08
#: A bit of Startup Configuration, and two of Shutdown and Hardware Error Status.
_TORQUE_AT_START, _VOLTAGE, _HEAT = 0x01, 0x01, 0x04
#: Bits of Moving Status, and the steps within which a servo is in position (our choice).
_IN_POSITION, _ONGOING, _FOLLOWING_ERROR, _NEAR = 0x01, 0x02, 0x08, 10
#: Options of Factory Reset, with the registers that each keeps; and the option and key of Clear.
_RESETS = {0xFF: (), 0x01: ("id",), 0x02: ("id", "baud")}
_CLEAR = bytes((0x01, 0x44, 0x58, 0x4C, 0x22))


class Shaft:
    """A servo's shaft without physics: it follows its trajectory with a lag.

    Attributes
    ----------
    lag
        µs.
    load
        Offset from the trajectory while torque is on, steps.
    low, high
        Steps that it cannot pass: set either to block the joint.
    noise
        Returns the error of a reading, in steps; it is called for every reading.
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
        self.place = float(min(max(self.place, self.low), self.high))
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
    shaft, table
        The shaft that it turns, and its control table.
    start_delay, clock
        Delay from an order to the start of its trajectory, µs, and the rate of the servo's clock.
    dead
        Unplugged, or without power: hears and says nothing.
    deaf
        Answers, but takes no orders.
    delay
        Extra µs before each answer.
    lie
        Maps the true position to the reading, both in steps.
    alias
        The id with which it answers, if that is not its own.
    segment, before
        The trajectory, None with torque off; and the one before it.
    """

    shaft: Shaft
    table: ControlTable
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
    _registered: tuple[int, bytes] | None = None

    def __post_init__(self) -> None:
        self._drive, self._count = MotorDrive(self.table), Count(self.table)

    @classmethod
    def new(
        cls,
        servo: int,
        position: float = 2048.0,
        shaft: Shaft | None = None,
        model: Model | None = None,
    ) -> "Servo":
        """Return a servo with an id and the bus speed of the card, and otherwise factory settings.

        ``model`` is by default the shipped XL330; others identified the constants of its motor.
        """
        made = cls(shaft or Shaft(position), ControlTable(model or load_servo("xl330-m288-t")))
        made.set("id", servo)
        made.set("baud", 3)
        return made

    def get(self, name: str) -> int:
        """Return an entry of the control table."""
        return self.table.get(name)

    def set(self, name: str, value: int) -> None:
        """Set an entry of the control table, bypassing all protection."""
        self.table.set(name, value)

    # --- power, torque and trajectory -------------------------------------------------------------

    def power_up(self) -> None:
        """Forget all but the EEPROM, as after a loss of power."""
        self.table.forget()
        self.segment = self.before = self._registered = None
        self._count_anew(self._heard)
        if self.get("startup") & _TORQUE_AT_START:
            place = self.shaft.position(self, self._heard)
            self.set("goal_position", self._count.to_host(place))
            self.set("torque_enable", 1)
            self._set_torque(True, self._heard)

    def fail(self, error: int) -> None:
        """Report a hardware error (4 overheating, 32 overload, …) and take torque off."""
        self.set("hardware_error", error)
        self.set("torque_enable", 0)
        self.segment = self.before = None

    def drive(self, time: float, place: float, speed: float) -> float | None:
        """Return the motor's duty, −1 to 1, for one period of the control; None with torque off.

        ``place`` is where the shaft is, in steps; ``speed`` its speed, in steps/s.
        """
        goal = self.setpoint(time)
        if goal is None or self.segment is None:
            self._drive.rest()
            return None
        return self._drive.turn(self.segment, time, goal - round(place), speed)

    def setpoint(self, time: float) -> float | None:
        """Where the servo wants its shaft at ``time``, in steps; None with torque off."""
        self._check_watchdog(time)
        segment = self._under_way(time)
        return None if segment is None else segment.at(time)

    def _under_way(self, time: float) -> Segment | None:
        segment = self.segment
        if segment is None or time >= segment.began or self.before is None:
            return segment
        return self.before

    def _go(self, time: float) -> None:
        if self.segment is None:
            return
        began, self.before = time + self.start_delay, self.segment
        initial = self.segment.speed_at(began, 1.0)
        origin, goal = self.segment.at(began), self._count.to_shaft(self.get("goal_position"))
        speed, ramp = self.get("profile_speed"), self.get("profile_acceleration")
        if self.get("drive_mode") & _IN_TIME:
            ms = 1e-3 / self.clock
            self.segment = Segment.in_time(began, origin, goal, speed * ms, ramp * ms)
            return
        self.segment = Segment(
            began,
            origin,
            goal,
            speed * SPEED_UNIT * self.clock,
            ramp * ACCELERATION_UNIT * self.clock**2,
            initial if speed and ramp else 0.0,
        )

    def _set_torque(self, on: bool, time: float) -> None:
        place = self.shaft.position(self, time)
        if not on:
            self.segment = self.before = None
        elif self.segment is None:
            if self.get("operating_mode") == POSITION:
                self._count_anew(time)
            # When torque is switched on, the motor pulls at once towards the goal in the table.
            goal = self._count.to_shaft(self.get("goal_position"))
            self.segment = Segment(time, place, goal, 0.0, 0.0)
            self.before = Segment(time - 1e6, place, place, 0.0, 0.0)

    def _check_watchdog(self, time: float) -> None:
        patience = self.table.get("bus_watchdog") * 20_000
        if patience > 0 and time - self._heard > patience:
            self.set("bus_watchdog", -1)
            if self.segment is not None:
                tripped = self._heard + patience
                here = self.segment.at(tripped)
                self.before = self.segment
                self.segment = Segment(tripped, here, here, 0.0, 0.0)

    @property
    def duty(self) -> float:
        """The motor's duty, −1 to 1."""
        return self._drive.duty

    def _count_anew(self, time: float) -> None:
        """Reset the count of whole turns in the position."""
        self._count.start_anew(self.shaft.position(self, time))

    # --- what it does when asked to ---------------------------------------------------------------

    def heard(self, time: float) -> None:
        """Record that a packet was on the bus."""
        self._check_watchdog(time)
        self._protect()
        self._heard = time

    def _protect(self) -> None:
        """Shut down on overheating or a wrong voltage, if the register Shutdown enables that."""
        hot = self.get("temperature") > self.get("temperature_limit")
        least, most = self.get("min_voltage_limit"), self.get("max_voltage_limit")
        fed = least <= self.get("voltage") <= most
        found = (_HEAT * hot | _VOLTAGE * (not fed)) & self.get("shutdown")
        if found & ~self.get("hardware_error"):
            self.fail(self.get("hardware_error") | found)

    def read(self, address: int, count: int, time: float) -> tuple[int, bytes]:
        """Return the error and the bytes of the control table."""
        addresses = self.table.behind(address, count)
        if self.table.unreadable(addresses):
            return self._error(ACCESS_ERROR), b""
        for name in self.table.measured(addresses):
            self.set(name, self._reading(name, time))
        data = self.table.data
        return self._error(0), bytes(data[at] if at < len(data) else 0 for at in addresses)

    def _reading(self, name: str, time: float) -> int:
        """Return the value of a register that the servo fills in when it is read."""
        sign, segment, value = self._count.sign, self._under_way(time), 0
        place = self.shaft.position(self, time)
        wanted = place if segment is None else segment.at(time)
        match name:
            case "realtime_tick":
                value = int(time / 1000) % 32_768
            case "pwm":
                value = round(self._drive.duty * FULL) * sign
            case "current":
                value = round(self._current(time) * 1000) * sign
            case "speed":
                value = round(self.shaft.speed(self, time) / SPEED_UNIT) * sign
            case "position":
                value = self.lie(self._count.to_host(place + self.shaft.noise()))
            case "position_trajectory":
                value = self._count.to_host(wanted)
            case "velocity_trajectory" if segment is not None:
                span = 1e6 / self.table.model.loop.rate
                value = round(segment.speed_at(time, span) / SPEED_UNIT) * sign
            case "moving_status" if segment is not None:
                near, behind = abs(segment.goal - place) <= _NEAR, abs(wanted - place) > TURN / 16
                value = segment.kind | _ONGOING * (wanted != segment.goal)
                value |= _IN_POSITION * near | _FOLLOWING_ERROR * behind
            case "moving":
                turns = abs(self._reading("speed", time)) > self.get("moving_threshold")
                value = int(turns or bool(self._reading("moving_status", time) & _ONGOING))
        return value

    def _current(self, time: float) -> float:
        """Return the current that it takes from the supply, A, with the sign of its duty."""
        model, duty = self.table.model, self._drive.duty
        turning = self.shaft.speed(self, time) * model.step
        volts = duty * model.supply.voltage
        amperes = duty * (volts - model.motor.back_emf * turning) / model.motor.resistance
        return amperes if duty >= 0 else -amperes

    def write(self, address: int, data: bytes, time: float, *, shared: bool = False) -> int:
        """Write to the control table; return the error.

        A ``shared`` write is one to the secondary id, which does not reach the EEPROM.
        """
        error = self._refusal(address, data)
        if shared and address < EEPROM_END:
            error = ACCESS_ERROR
        if error or self.deaf:
            return self._error(error)
        # The shaft's motion up to now is computed before the write takes effect.
        self.shaft.position(self, time)
        written = self.table.behind(address, len(data))
        torque, mode = REGISTERS["torque_enable"].address, self.get("operating_mode")
        if torque in written:
            self._set_torque(bool(data[written.index(torque)]), time)
        for at, byte in zip(written, data, strict=True):
            self.table.set_byte(at, byte)
        if self.get("operating_mode") != mode:
            self.table.change_mode()
            if self.get("operating_mode") == POSITION:
                self._count_anew(time)
        if REGISTERS["goal_position"].address in written:
            if self.get("drive_mode") & _TORQUE_BY_GOAL and not self.get("hardware_error"):
                self._set_torque(True, time)
                self.set("torque_enable", 1)
            self._go(time)
        return self._error(0)

    def _refusal(self, address: int, data: bytes) -> int:
        written = self.table.behind(address, len(data))
        error = self.table.refusal(written, data)
        first, last = REGISTERS["goal_pwm"].address, REGISTERS["realtime_tick"].address
        bitten = self.get("bus_watchdog") == -1 and any(first <= at < last for at in written)
        return error or (RANGE_ERROR if bitten else 0)

    def register(self, address: int, data: bytes) -> int:
        """Keep a write until an action asks for it; return the error."""
        error = self._refusal(address, data)
        if not error and not self.deaf:
            self._registered = address, data
            self.set("registered_instruction", 1)
        return self._error(error)

    def act(self, time: float) -> int:
        """Write what was kept; return the error."""
        if self._registered is None:
            return self._error(INSTRUCTION_ERROR)
        (address, data), self._registered = self._registered, None
        self.set("registered_instruction", 0)
        return self.write(address, data, time)

    def reset(self, option: int, *, to_all: bool) -> int:
        """Restore factory defaults, except registers that the option keeps; return the error.

        A reset of everything is not carried out if it is sent ``to_all``.
        """
        if option not in _RESETS or (to_all and not _RESETS[option]):
            return self._error(RANGE_ERROR)
        if not self.deaf:
            self.table.reset(*_RESETS[option])
            self.power_up()
        return self._error(0)

    def clear(self, what: bytes, time: float) -> int:
        """Reset the position's count of whole turns if the servo is at rest; return the error."""
        if what != _CLEAR:
            return self._error(RANGE_ERROR)
        if self._reading("moving", time):
            return self._error(_FAILED)
        if not self.deaf:
            self._count_anew(time)
        return self._error(0)

    def _error(self, error: int) -> int:
        return error | (_ALERT if self.get("hardware_error") else 0)
