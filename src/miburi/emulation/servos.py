"""DYNAMIXEL XL330 servos in Python: the devices on a card's servo bus when there are no real ones.

The emulated servos follow speed profiles as the XL330's manual describes them, and can be blocked,
loaded, dead, deaf, hot, slow to answer, and unplugged. :class:`miburi.emulation.bus.Bus` is their
wire.

Times are in µs on the card's clock. Positions are those of the shaft, in the servo's steps; they
are floats until a host reads them. A host counts positions within one turn: the turn in which the
servo was when it started, or when its torque came on. The emulation has no features that a card
never uses: goals other than positions and PWM, reverse and homing offset, profiles in time, and the
servo's own protection.
"""

from collections.abc import Callable
from dataclasses import dataclass

from miburi.emulation.control_table import REGISTERS
from miburi.emulation.drive import FULL, MotorDrive
from miburi.emulation.table import ACCESS_ERROR, RANGE_ERROR, ControlTable
from miburi.emulation.trajectory import Segment
from miburi.servos import Servo as Model
from miburi.servos import load_servo

#: Steps in a turn.
_TURN = 4096
#: The bit in the error of every answer that says whether there is a hardware error.
_ALERT = 0x80
#: One unit of the servo's speed and of its acceleration, in steps/s and steps/s².
SPEED_UNIT = 0.229 * 4096 / 60
ACCELERATION_UNIT = 214.577 * 4096 / 3600
#: A bit of Startup Configuration.
_TORQUE_AT_START = 0x01


class Shaft:
    """A servo's shaft without physics: it follows its trajectory with a lag.

    Attributes
    ----------
    lag
        How long the shaft lags behind its trajectory, in µs.
    load
        How far the shaft is off its trajectory while torque is on, in steps.
    low, high
        Positions, in steps, that the shaft cannot pass: set either to block the joint.
    noise
        Returns the error of a reading, in steps; it is called for every reading.
    """

    def __init__(self, position: float = 2048.0, lag: float = 30_000.0) -> None:
        self.place, self.lag, self.load = position, lag, 0.0
        self.low, self.high = float("-inf"), float("inf")
        self.noise: Callable[[], float] = lambda: 0.0
        self._before: Segment | None = None

    def position(self, servo: "Servo", time: float) -> float:
        """Return the shaft's position at ``time``, in steps."""
        if servo.segment is not None:
            past = time - self.lag
            segment = servo.segment
            if past < segment.began and servo.before is not None:
                segment = servo.before
            self.place = segment.at(past) + self.load
        self.place = float(min(max(self.place, self.low), self.high))
        return self.place

    def speed(self, servo: "Servo", time: float) -> float:
        """Return the shaft's mean speed over the latest 10 ms, in steps/s."""
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
        The delay from an order to the start of its trajectory, in µs, and the rate of the servo's
        clock.
    dead
        Unplugged, or without power: hears and says nothing.
    deaf
        Answers, but ignores orders.
    delay
        An additional delay before each answer, in µs.
    lie
        Maps the true position to the reading, both in steps.
    alias
        The id with which it answers, if that is not its own.
    segment, before
        The present trajectory (None with torque off), and the trajectory before it.
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
    _turns: int = 0  # whole turns that a host's positions leave out, in steps

    def __post_init__(self) -> None:
        self._drive = MotorDrive(self.table)

    @classmethod
    def new(
        cls,
        servo: int,
        position: float = 2048.0,
        shaft: Shaft | None = None,
        model: Model | None = None,
    ) -> "Servo":
        """Return a servo with an id and the bus speed of the card, and otherwise factory settings.

        ``model`` is by default the XL330 that ships with Miburi, the constants of whose motor
        others have identified.
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
        self.segment = self.before = None
        self._leave_out_turns(self._heard)
        if self.get("startup") & _TORQUE_AT_START:
            place = self.shaft.position(self, self._heard)
            self.set("goal_position", self._as_counted(place))
            self.set("torque_enable", 1)
            self._set_torque(True, self._heard)

    def fail(self, error: int) -> None:
        """Report a hardware error (4 overheating, 32 overload, …) and take torque off."""
        self.set("hardware_error", error)
        self.set("torque_enable", 0)
        self.segment = self.before = None

    def drive(self, time: float, place: float, speed: float) -> float | None:
        """Return the motor's duty, −1 to 1, for one period of the control; None with torque off.

        ``place`` and ``speed`` are the shaft's position and speed, in steps and steps/s.
        """
        goal = self.setpoint(time)
        if goal is None:
            self._drive.duty = 0.0
            return None
        return self._drive.turn(goal - round(place), speed)

    def setpoint(self, time: float) -> float | None:
        """Return the shaft's commanded position at ``time``, in steps; None with torque off."""
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
        speed, ramp = self.get("profile_speed"), self.get("profile_acceleration")
        self.segment = Segment(
            began,
            self.segment.at(began),
            self._goal,
            speed * SPEED_UNIT * self.clock,
            ramp * ACCELERATION_UNIT * self.clock**2,
            initial if speed and ramp else 0.0,
        )

    def _set_torque(self, on: bool, time: float) -> None:
        place = self.shaft.position(self, time)
        if not on:
            self.segment = self.before = None
        elif self.segment is None:
            self._leave_out_turns(time)
            # When torque is switched on, the motor pulls at once towards the goal in the table.
            self.segment = Segment(time, place, self._goal, 0.0, 0.0)
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
    def _goal(self) -> int:
        """The goal in the table, as a position of the shaft."""
        return self.get("goal_position") + self._turns

    def _as_counted(self, place: float) -> int:
        """Return the position that a host reads while the shaft is at ``place``."""
        return round(place) - self._turns

    def _leave_out_turns(self, time: float) -> None:
        """From now on, count the position within the turn in which the shaft is."""
        self._turns = round(self.shaft.position(self, time)) // _TURN * _TURN

    # --- answers to requests ----------------------------------------------------------------------

    def heard(self, time: float) -> None:
        """Record that a packet was on the bus."""
        self._check_watchdog(time)
        self._heard = time

    def read(self, address: int, count: int, time: float) -> tuple[int, bytes]:
        """Return the error and the bytes of the control table."""
        if not self.table.readable(address, count):
            return self._error(ACCESS_ERROR), b""
        for name in self.table.measured(address, count):
            self.set(name, self._reading(name, time))
        return self._error(0), bytes(self.table.data[address : address + count])

    def _reading(self, name: str, time: float) -> int:
        """Return the value of a register that the servo fills in when it is read."""
        place, segment = self.shaft.position(self, time), self._under_way(time)
        match name:
            case "pwm":
                return round(self._drive.duty * FULL)
            case "current":
                return round(self._current(time) * 1000)
            case "speed":
                return round(self.shaft.speed(self, time) / SPEED_UNIT)
            case "position":
                return self.lie(self._as_counted(place + self.shaft.noise()))
            case _:  # the trajectory's position
                return self._as_counted(place if segment is None else segment.at(time))

    def _current(self, time: float) -> float:
        """Return the current in A that the servo draws from the supply, signed like its duty."""
        model, duty = self.table.model, self._drive.duty
        turning = self.shaft.speed(self, time) * model.step
        volts = duty * model.supply.voltage
        amperes = duty * (volts - model.motor.back_emf * turning) / model.motor.resistance
        return amperes if duty >= 0 else -amperes

    def write(self, address: int, data: bytes, time: float) -> int:
        """Write to the control table; return the error."""
        written = range(address, address + len(data))
        error = self.table.refusal(address, data)
        first, last = REGISTERS["goal_pwm"].address, REGISTERS["realtime_tick"].address
        bitten = self.get("bus_watchdog") == -1 and any(first <= at < last for at in written)
        if bitten and not error:
            error = RANGE_ERROR
        if error or self.deaf:
            return self._error(error)
        # The shaft's motion up to now is computed before the write takes effect.
        self.shaft.position(self, time)
        torque, mode = REGISTERS["torque_enable"].address, self.get("operating_mode")
        if torque in written:
            self._set_torque(bool(data[torque - address]), time)
        self.table.write(address, data)
        if self.get("operating_mode") != mode:
            self.table.change_mode()
            self._leave_out_turns(time)
        if REGISTERS["goal_position"].address in written:
            self._go(time)
        return self._error(0)

    def _error(self, error: int) -> int:
        return error | (_ALERT if self.get("hardware_error") else 0)
