"""How a servo drives its motor: it computes a duty from its control table."""

from struct import Struct
from typing import NamedTuple

from miburi.emulation.control import FULL, Control, PidGains
from miburi.emulation.control_table import REGISTERS
from miburi.emulation.count import POSITION, Count
from miburi.emulation.table import GAINS, ControlTable
from miburi.emulation.trajectory import Segment

__all__ = ["MotorDrive"]

#: Operating modes in which this module drives the motor; in the modes for current and speed the
#: motor gets no duty.
_EXTENDED, _CURRENT_AND_POSITION, _PWM = 4, 5, 16
_POSITIONS = (POSITION, _EXTENDED, _CURRENT_AND_POSITION)
_GAINS_BYTES, _GAINS_AT = Struct("<3H2x2H"), REGISTERS[GAINS[0]].address


class _Orders(NamedTuple):
    """What the table asks of the motor, looked up when something in it changes."""

    gains: PidGains | None  # None where a PWM is asked for
    most: float
    pwm: float
    slope: int


class MotorDrive:
    """The drive of one servo.

    Parameters
    ----------
    table
        Its control table, which it only reads.
    """

    def __init__(self, table: ControlTable) -> None:
        self._table, self._control = table, Control(table.model)
        self._seen, self._orders = table.changes, self._look_up()

    @property
    def duty(self) -> float:
        """The motor's present duty, −1 to 1."""
        return self._control.duty

    def rest(self) -> None:
        """Reset everything, as with torque off."""
        self._control.rest()

    def turn(self, segment: Segment, time: float, error: float, speed: float) -> float:
        """Return the duty at a time, µs; ``error`` is in steps, speed in steps/s."""
        if self._seen != self._table.changes:
            self._seen, self._orders = self._table.changes, self._look_up()
        orders = self._orders
        pwm = orders.pwm
        if orders.gains is not None:
            wanted = 0.0
            if orders.gains.first or orders.gains.second:
                wanted = segment.speed_at(time, 1e6 / self._table.model.loop.rate)
            pwm = self._control.follow(orders.gains, error, speed, wanted, orders.most)
        return self._control.set_pwm(pwm, orders.slope)

    def _look_up(self) -> _Orders:
        get, data_sheet = self._table.get, self._table.model.data_sheet
        mode, ceiling = get("operating_mode"), get("goal_pwm")
        most: float = min(abs(ceiling), get("pwm_limit"))
        pwm, gains = 0.0, None
        if mode == _PWM:
            pwm = min(max(ceiling, -most), most) * Count(self._table).sign
        elif mode in _POSITIONS:
            if mode == _CURRENT_AND_POSITION:
                share = abs(get("goal_current")) / 1e3 / data_sheet.stall_current
                most = min(most, share * FULL)
            gains = PidGains(*_GAINS_BYTES.unpack_from(self._table.data, _GAINS_AT))
        return _Orders(gains, most, pwm, get("pwm_slope"))
