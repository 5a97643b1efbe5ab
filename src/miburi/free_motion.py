"""How a free servo would have moved: what the contact rule expects, in integers as on the card.

The rule compares each motor's speed with the one it should have. The delayed profile is what a
stiff servo would do; this is what *this* servo with *this* load does if nobody is in its way: a
spring between the commanded profile and the motor, with back EMF, friction and the part's weight
(:mod:`miburi.servos.model`, at nominal voltage, with each joint's inertia in the middle of its
range). It is worked out in steps of 5 ms, each

    motor  = a1 · (profile − x, at most ± most) − a2 · v
    v     += motor − a1 · sag, then less the dry friction, that stops it at most
    x     += v

Positions are in 1/65536 encoder step, counted along the move; v in these for each 5 ms. Shifts
round down, as C's do.
"""

from dataclasses import dataclass, field

import numpy as np

from miburi.compiled import compiled
from miburi.contact import UNLOADED, Loading, Rule, Watch
from miburi.motion import FINE, Profile, Steps
from miburi.robot import Array, Robot
from miburi.robot.loads import loads

#: µs of one step of the model.
STEP = 5000
#: The coefficients' unit, and that of the share of a torque that the gears take.
_ONE, _SHARE = 1 << 16, 1 << 8


@dataclass(frozen=True)
class FreeServo:
    """A motor with its joint; all (8,) int64.

    Attributes
    ----------
    pull, brake
        a1 and a2 in 1/65536: what an error, and a speed, change of the speed in a step.
    friction
        1/65536 encoder step for each 5 ms that dry friction takes of the speed in a step.
    lost
        Share of the motor's torque that the gears take as friction, in 1/256.
    """

    pull: Steps
    brake: Steps
    friction: Steps
    lost: Steps

    @classmethod
    def of(cls, robot: Robot) -> "FreeServo":
        """Return the robot's motors as its description has them."""
        servo = robot.servo.model
        inertia = servo.motor.armature + loads(robot, (robot.lower + robot.upper) / 2).inertia
        per_torque = (STEP / 1e6) ** 2 / inertia
        brake = (servo.damping + servo.control_damping) * (STEP / 1e6) / inertia
        dry = (servo.friction.dry + servo.friction.stiction) / servo.step

        def whole(values: Array | float) -> Steps:
            steps: Steps = np.rint(np.broadcast_to(values, inertia.shape)).astype(np.int64)
            return steps

        return cls(
            pull=whole(servo.stiffness * per_torque * _ONE),
            brake=whole(brake * _ONE),
            friction=whole(dry * per_torque * _ONE),
            lost=whole(servo.friction.motor_load * _SHARE),
        )


@compiled
def advance(
    x: Steps,
    v: Steps,
    before: Steps,
    now: Steps,
    steps: int,
    sag: Steps,
    most: Steps,
    pull: Steps,
    brake: Steps,
    friction: Steps,
    lost: Steps,
) -> None:
    """Let ``x`` and ``v`` (8,) pass ``steps`` steps, while the profile goes on.

    It goes from ``before`` to ``now``, (8,) in 1/256 encoder step, as ``sag`` and ``most`` are:
    the error that the load takes, and the one at which the duty has its limit.
    """
    for j in range(len(x)):
        for k in range(1, steps + 1):
            profile = before[j] + (now[j] - before[j]) * k // steps
            error = min(max(profile - (x[j] >> 8), -most[j]), most[j])
            motor = ((pull[j] * error) >> 8) - ((brake[j] * (v[j] >> 8)) >> 8)
            speed = v[j] + motor - ((pull[j] * sag[j]) >> 8)
            taken = friction[j] + ((lost[j] * abs(motor)) >> 8)
            v[j] = max(speed - taken, 0) if speed > 0 else min(speed + taken, 0)
            x[j] += v[j]


@dataclass(frozen=True)
class FreeRule(Rule):
    """The paper's period and ratio, against the speed that the free servo would have had.

    A lag of 5.5 ms fits the model best: half of it is what steps of 5 ms are early, the rest the
    servo's own delay.
    """

    servo: FreeServo = field(kw_only=True)

    @classmethod
    def of(cls, robot: Robot) -> "FreeRule":
        """Return the rule with the guards of the robot's servo."""
        return cls(Rule.of(robot).guards, servo=FreeServo.of(robot))

    def watch(
        self, profile: Profile, start: Steps, direction: Steps, loading: Loading = UNLOADED
    ) -> Watch:
        """Begin to watch one move of loaded motors."""
        return _FreeWatch(self, profile, start, direction, loading)


class _FreeWatch(Watch):
    rule: FreeRule

    def __post_init__(self) -> None:
        super().__post_init__()
        loading = self.loading
        # Where loaded motors come to rest, but for friction.
        self._goal = self._goal + loading.offset - loading.end
        self._x = np.zeros_like(self.start)
        self._v = np.zeros_like(self.start)
        self._profile_then = loading.offset.copy()
        self._model_time = 0

    def _due(self, time: int) -> Steps:
        """Travel that the free servo would have brought, (8,) in 1/256 steps."""
        servo, loading = self.rule.servo, self.loading
        steps = (time - self._model_time) // STEP
        if steps > 0:
            self._model_time += steps * STEP
            went = self.profile.position(self._model_time - self.rule.guards.lag)
            way = np.maximum(self.profile.distance, 1)
            share = went // way  # in 1/256, as positions are
            sag = loading.begin + (((loading.end - loading.begin) * share) >> 8)
            now = loading.offset + went
            advance(
                self._x, self._v, self._profile_then, now, steps, sag, loading.most,
                servo.pull, servo.brake, servo.friction, servo.lost,
            )  # fmt: skip
            self._profile_then = now
        rest = (time - self._model_time) * FINE // STEP
        return (self._x >> 8) + (((self._v >> 8) * rest) >> 8)
