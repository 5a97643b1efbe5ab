"""How a servo drives its motor: it computes the duty from its control table and its encoder.

The computation follows ROBOTIS's e-manual, "Position PID Gain", in PWM units (885 is the full
voltage)::

    PWM = P/p_divisor · e − D/d_divisor · v

e is the error in steps, and v the speed in steps per control period. Goal PWM and PWM Limit bound
the PWM, and the duty approaches this value at the PWM's slope. I gain and feed-forward, which a
card sets to 0, have no effect here.
"""

from miburi.emulation.table import POSITION, ControlTable

#: PWM units at full voltage.
FULL = 885
#: The operating mode in which Goal PWM sets the duty. In all other modes but position control, the
#: duty is 0.
_PWM = 16
#: The factory setting of the PWM's slope, to which the servo's constants refer.
_SLOPE = 140


class MotorDrive:
    """The drive of one servo.

    The drive only reads ``table``, the servo's control table.

    Attributes
    ----------
    duty
        The motor's present duty, −1 to 1; 0 with torque off.
    """

    def __init__(self, table: ControlTable) -> None:
        self.duty = 0.0
        # Read once, because the drive of each of eight servos runs every ms.
        model = table.model
        self._table, self._rate = table, model.loop.rate
        self._p_divisor, self._d_divisor = model.divisor.p_divisor, model.gains.d_divisor
        self._slope, self._voltage = model.gains.pwm_slope, model.supply.voltage
        self._look_up()

    def turn(self, error: float, speed: float) -> float:
        """Return the duty of the next period; ``error`` is in steps, ``speed`` in steps/s."""
        if self._seen != self._table.changes:
            self._look_up()
        pwm: float = self._pwm
        if self._follows:
            pwm = self._p / self._p_divisor * error - self._d / self._d_divisor * speed / self._rate
            pwm = min(max(pwm, -self._most), self._most)
        self.duty += min(max(pwm / FULL - self.duty, -self._rise), self._rise)
        return self.duty

    def _look_up(self) -> None:
        """Read the registers; the values stay valid until the table changes."""
        get, self._seen = self._table.get, self._table.changes
        mode, goal = get("operating_mode"), get("goal_pwm")
        self._most = min(abs(goal), get("pwm_limit"))
        self._follows = mode == POSITION
        self._pwm = min(max(goal, -self._most), self._most) if mode == _PWM else 0
        self._p, self._d = get("position_p_gain"), get("position_d_gain")
        self._rise = self._slope * get("pwm_slope") / _SLOPE / self._rate / self._voltage
