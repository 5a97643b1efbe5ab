"""A servo's position control: it computes the duty from gains, trajectory and encoder.

It follows ROBOTIS's e-manual, "Position PID Gain", in PWM units (885 is the full voltage)::

    PWM = P/p_divisor · e + I/65536 · Σ e − D/d_divisor · v + FF1/4 · u + FF2/4 · (change of u)

e is the error in steps, v the speed and u the trajectory's speed, both in steps per control period.
Goal PWM and PWM Limit bound the PWM, and the duty approaches it at the slope of the PWM. The manual
gives neither the units of its feed-forward nor the working of its anti-windup: both are our
assumptions.
"""

from dataclasses import dataclass
from typing import NamedTuple

from miburi.servos import Servo

__all__ = ["FULL", "Control", "PidGains"]

#: PWM units at full voltage.
FULL = 885
_I_DIVISOR, _FF_DIVISOR = 65_536, 4
#: The factory setting of the PWM's slope, to which the servo's constants refer.
_SLOPE = 140


class PidGains(NamedTuple):
    """The registers of the position control, 80 to 90."""

    d: int
    i: int
    p: int
    second: int
    first: int


@dataclass
class Control:
    """The control of one servo, with its state between two periods.

    Attributes
    ----------
    model
        The servo's constants.
    duty
        The motor's present duty, −1 to 1.
    """

    model: Servo
    duty: float = 0.0
    _sum: float = 0.0
    _before: float = 0.0

    def __post_init__(self) -> None:
        # Read once, because the control of each of eight servos runs every ms.
        model = self.model
        self._rate, self._p_divisor = model.loop.rate, model.divisor.p_divisor
        self._d_divisor = model.gains.d_divisor
        self._slope, self._voltage = model.gains.pwm_slope, model.supply.voltage

    def rest(self) -> None:
        """Reset everything, as with torque off."""
        self.duty = self._sum = self._before = 0.0

    def follow(
        self, gains: PidGains, error: float, speed: float, wanted: float, most: float
    ) -> float:
        """Return the PWM of the position control, from −``most`` to ``most``.

        ``error`` is in steps; ``speed`` and ``wanted``, the trajectory's speed, are in steps/s.
        Without feed-forward gains ``wanted`` does not matter.
        """
        rate = self._rate
        ahead = gains.first * wanted + gains.second * (wanted - self._before)
        pwm = (
            gains.p / self._p_divisor * error
            - gains.d / self._d_divisor * speed / rate
            + ahead / _FF_DIVISOR / rate
        )
        self._before = wanted
        whole = self._sum + gains.i / _I_DIVISOR * error
        # Where the PWM is already at its limit, the integral grows no further.
        if abs(pwm + whole) <= most or abs(whole) < abs(self._sum):
            self._sum = whole
        return min(max(pwm + self._sum, -most), most)

    def set_pwm(self, pwm: float, slope: int) -> float:
        """Return the next period's duty: it approaches ``pwm`` no faster than the slope allows.

        ``slope`` is register 62.
        """
        most = self._slope * slope / _SLOPE / self._rate / self._voltage
        self.duty += min(max(pwm / FULL - self.duty, -most), most)
        return self.duty
