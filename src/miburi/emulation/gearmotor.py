"""A servo's shaft with its motor and gears; it turns an inertia, and may meet a load or a wall.

This shaft needs no body: it is for tests of one servo, or of a card with eight servos. In
:class:`miburi.emulation.body.EmulatedBody` the servos move a whole simulated body.
"""

from miburi.emulation.servos import Servo, Shaft
from miburi.servos import Axis
from miburi.servos import Servo as Model


class Gearmotor(Shaft):
    """A shaft that a servo's motor turns; see :class:`miburi.servos.Axis`.

    ``low`` and ``high`` block the shaft as in :class:`Shaft`, and ``load`` is in N·m. ``model`` has
    the servo's constants, ``position`` is the shaft's first position in steps, and ``inertia`` is
    the inertia, in kg·m², of what hangs on the shaft.
    """

    def __init__(self, model: Model, position: float = 2048.0, inertia: float = 1e-3) -> None:
        self.axis, self._zero, self._time = Axis(model, inertia), position, 0.0
        super().__init__(position, lag=0.0)

    @property
    def place(self) -> float:
        """The shaft's position in steps; setting it moves the shaft at once, as a hand would."""
        return self._zero + self.axis.angle / self.axis.servo.step

    @place.setter
    def place(self, place: float) -> None:
        self._zero = place - self.axis.angle / self.axis.servo.step

    def position(self, servo: Servo, time: float) -> float:
        """Let the shaft turn until ``time``, and return where it then is, in steps."""
        axis, rate = self.axis, self.axis.servo.loop.rate
        step = axis.servo.step
        axis.load = self.load
        axis.low, axis.high = ((end - self._zero) * step for end in (self.low, self.high))
        while self._time + 1e6 / rate <= time:
            self._time += 1e6 / rate
            axis.turn(servo.drive(self._time, self.place, axis.speed / step), 1 / rate)
        return self.place

    def speed(self, servo: Servo, time: float) -> float:
        """Return the shaft's speed, in steps/s."""
        self.position(servo, time)
        return self.axis.speed / self.axis.servo.step
