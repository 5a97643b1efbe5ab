"""A detailed model of one servo with its load, in plain Python with fine time steps.

It includes effects that the simulated body omits to save time: the rate of the control, rounding to
encoder steps and the ramp of the PWM. Like the simulated body, it includes the backlash between
gears and horn. It shows how much these effects matter, and it moves emulated servos.
"""

from dataclasses import dataclass
from math import copysign, inf

from miburi.servos.servo import Servo
from miburi.servos.voltage import dry_friction

#: Time step in s; it must be below 0.4 ms to resolve the contact at the end of the backlash.
_STEP = 1e-4
#: The stiffness (N·m/rad) and the damping (N·m·s/rad) of the gears' teeth where the play ends, and
#: of an obstacle at the horn (our choice).
_STOP, _STOP_DAMPING = 200.0, 0.05


@dataclass
class Axis:
    """A servo that starts at rest at angle 0. Angles are in rad, torques in N·m.

    Attributes
    ----------
    servo
        The constants.
    inertia
        The inertia on the horn, in kg·m²; more than 0.
    load
        Torque on the horn from outside; it may change at any time.
    duty_limit
        The largest duty, 0 to 1 (Goal PWM).
    angle, speed
        The horn's angle, in rad, and its speed, in rad/s; the encoder sits on the horn.
    low, high
        The angles at which something stiff stops the horn.
    duty
        The duty that the control sets now, −1 to 1.
    current
        The current through the motor, in A.
    """

    servo: Servo
    inertia: float
    load: float = 0.0
    duty_limit: float = 1.0
    low: float = -inf
    high: float = inf
    angle: float = 0.0
    speed: float = 0.0
    duty: float = 0.0
    current: float = 0.0
    time: float = 0.0

    def __post_init__(self) -> None:
        self._rotor, self._rotor_speed = self.angle, self.speed
        self._steps = round(1 / (self.servo.loop.rate * _STEP))
        self._until_control = 0
        self._open = False

    def turn(self, duty: float | None, seconds: float) -> None:
        """Let ``seconds``, a multiple of 0.1 ms, pass at a duty; None switches the current off."""
        self._open, self.duty = duty is None, duty or 0.0
        for _ in range(round(seconds / _STEP)):
            self._move()

    def advance(self, goal: float, seconds: float) -> None:
        """Let ``seconds``, a multiple of 0.1 ms, pass with the trajectory at ``goal``, in rad."""
        for _ in range(round(seconds / _STEP)):
            if self._until_control == 0:
                self._control(goal)
                self._until_control = self._steps
            self._until_control -= 1
            self._move()

    def _control(self, goal: float) -> None:
        servo, gains = self.servo, self.servo.gains
        error = (goal - round(self.angle / servo.step) * servo.step) * servo.duty_per_rad
        wanted = error - self.speed * servo.duty_per_speed
        wanted = min(max(wanted, -self.duty_limit), self.duty_limit)
        most = gains.pwm_slope / servo.loop.rate / servo.supply.voltage
        self.duty += min(max(wanted - self.duty, -most), most)

    def _move(self) -> None:
        servo, motor, friction = self.servo, self.servo.motor, self.servo.friction
        voltage = servo.supply.voltage - servo.supply.resistance * abs(self.duty * self.current)
        driving = self.duty * voltage - motor.back_emf * self._rotor_speed
        self.current = 0.0 if self._open else driving / motor.resistance
        torque = motor.torque_constant * self.current
        load, beyond = self.load, self.angle - min(max(self.angle, self.low), self.high)
        if beyond:
            load -= _STOP * beyond + _STOP_DAMPING * self.speed
        bound = dry_friction(*friction.row, torque, load, self._rotor_speed)
        bound += friction.viscous * abs(self._rotor_speed)
        self.time += _STEP
        if servo.loop.backlash == 0:
            inertia = motor.armature + self.inertia
            self.speed = _stopped(self.speed, torque + load, bound, inertia)
            self.angle += self.speed * _STEP
            self._rotor, self._rotor_speed = self.angle, self.speed
            return
        play = self._rotor - self.angle
        over = play - copysign(min(abs(play), servo.loop.backlash / 2), play)
        passed = _STOP * over + (_STOP_DAMPING * (self._rotor_speed - self.speed) if over else 0.0)
        self._rotor_speed = _stopped(self._rotor_speed, torque - passed, bound, motor.armature)
        self.speed += (passed + load) / self.inertia * _STEP
        self._rotor += self._rotor_speed * _STEP
        self.angle += self.speed * _STEP


def _stopped(speed: float, torque: float, friction: float, inertia: float) -> float:
    """Return the speed after a step; friction can bring it to rest, but no further."""
    free = speed + torque / inertia * _STEP
    return copysign(max(0.0, abs(free) - friction / inertia * _STEP), free)
