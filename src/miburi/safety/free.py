"""The contact rule that compares each motor with a model of the same servo moving freely.

The rule compares each motor's speed with the speed it should have. The delayed profile is the
motion of a stiff servo; :mod:`miburi.servos.free` models *this* servo with *this* load while nobody
is in its way. The model assumes the nominal voltage, each joint's inertia at the middle of its
range, and a load that varies linearly from the move's start to its end. The model begins with the
motor's own speed, because a motor that still swings after its last move has not hit anything.

The model's error grows with the speed, up to some 500 steps/s. So the guards ``slack``, ``behind``
and ``ahead`` hold for a motor that reaches ``FAST`` in its move. A motor at rest has half of
each guard; a slow motor has more, in proportion to its speed. Until ``SETTLES`` after the start of
a move, the speed with which a motor swung at the start counts, too. With a slack of 10 steps::

    top speed in the move [steps/s]     0   128   256   384   512   1000
    slack [steps]                       5  6.25   7.5  8.75    10     10

Importing this module loads Numba.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from miburi.robot import Robot
from miburi.robot.guards import in_whole_units
from miburi.robot.loads import loads
from miburi.safety.contact import UNLOADED, Contact, Loading, Rule, Watch, lag_doubt
from miburi.safety.profile import FINE, SECOND, Profile, Steps
from miburi.servos.free import STEP, FreeServo, advance

#: A motor that reaches this speed, in 1/256 steps/s, in its move has the full guards (our choice).
FAST = 512 * FINE
#: A motor that swings at a move's start has come to rest after this long, in µs (our choice).
SETTLES = 200_000


@dataclass(frozen=True)
class FreeRule(Rule):
    """The paper's period and ratio, applied to the speed of the free servo.

    The lag is the one with which the model fits the servo best: 5.5 ms for the XL330, with the
    constants that other people have identified. Half of it makes up for the model's time steps of
    5 ms, since the model is early by half a step; the rest is the servo's own delay.

    Attributes
    ----------
    servo
        The motors, as they move if nobody is in their way.
    sag
        Each motor's sag divided by the sag that the masses in the description predict, (8,) in
        units of 1/256.
    """

    servo: FreeServo = field(kw_only=True)
    sag: Steps = field(kw_only=True, default_factory=lambda: np.full(8, FINE, dtype=np.int64))

    @classmethod
    def of(cls, robot: Robot) -> "FreeRule":
        """Return the rule, with the robot's guards, if nobody has calibrated the robot's servos."""
        middle = loads(robot, (robot.lower + robot.upper) / 2)
        servo = FreeServo.of(robot.servo.model, middle.inertia)
        return cls(in_whole_units(robot.guards, robot.servo.step), servo=servo)

    def watch(
        self, profile: Profile, start: Steps, direction: Steps, loading: Loading = UNLOADED
    ) -> Watch:
        """Begin to watch one move of loaded motors."""
        begin, end = (loading.begin * self.sag) >> 8, (loading.end * self.sag) >> 8
        own = replace(loading, begin=begin, end=end)
        return _FreeWatch(self, profile, start, direction, own)


def granted_share(profile: Profile, velocity: Steps | int = 0) -> Steps:
    """Return which share of its guards each motor is granted in this move, (8,) in 1/256."""
    top = np.maximum(profile.fastest, np.abs(velocity))
    share: Steps = (FINE + FINE * np.minimum(top, FAST) // FAST) // 2
    return share


class _FreeWatch(Watch):
    rule: FreeRule

    def __post_init__(self) -> None:
        super().__post_init__()
        loading = self.loading
        self._swings = True
        self._grant(granted_share(self.profile, loading.velocity), lag_doubt(self.profile))
        # Where loaded motors would come to rest if there were no friction.
        self._goal = self._goal + loading.offset - loading.end
        self._x = loading.gone * FINE
        fast = np.abs(loading.velocity) * FINE * STEP // SECOND
        self._v = np.sign(loading.velocity) * fast
        self._profile_then = loading.offset.copy()
        self._model_time = 0

    def _grant(self, share: Steps, doubt: Steps) -> None:
        guards = self.rule.guards
        self._granted = share, doubt
        self._slack = guards.slack * share
        self._behind, self._ahead = guards.behind * share + doubt, guards.ahead * share + doubt

    def go_on(self, before: Watch, seen: int, elapsed: int) -> None:
        """Continue from an earlier watch, with the position and speed of its modelled servo."""
        goal = self._goal
        super().go_on(before, seen, elapsed)
        self._goal = goal  # it includes the offset already
        if not isinstance(before, _FreeWatch):
            raise TypeError(
                f"a watch with a servo model can only continue from another, got {before!r}."
            )
        turned = before.direction * self.direction
        moved = (before.start - self.start) * self.direction * FINE
        self._x, self._v = turned * before._x + moved * FINE, turned * before._v
        self._profile_then = turned * before._profile_then + moved
        self._model_time = before._model_time - elapsed
        # At first a motor keeps the earlier move's guards if they are wider, since it may still be
        # as far behind as in that move.
        self._grant(*map(np.maximum, self._granted, before._granted))

    def look(self, positions: Steps, time: int) -> Contact | None:
        """Judge the positions; guards are wider until ``SETTLES``, as motors may still swing."""
        if self._swings and time >= SETTLES:
            self._swings = False
            self._grant(granted_share(self.profile), lag_doubt(self.profile))
        return super().look(positions, time)

    def expected_travel(self, time: int) -> Steps:
        """Return how far the free servo would have travelled, (8,) in 1/256 steps."""
        servo, loading = self.rule.servo, self.loading
        steps = (time - self._model_time) // STEP
        if steps > 0:
            self._model_time += steps * STEP
            went = self.profile.position(self._model_time - self.rule.guards.lag)
            distance = self.profile.distance
            # The share of the way is in 1/256, like positions. For motors that come back from
            # beyond the ends of their travel, the share would be outside 0 to 1.
            share = np.clip(went // np.maximum(distance, 1), 0, np.where(distance > 0, FINE, 0))
            sag = loading.begin + (((loading.end - loading.begin) * share) >> 8)
            now = loading.offset + went
            then = self._profile_then
            advance(self._x, self._v, then, now, steps, sag, loading.most, servo)
            self._profile_then = now
        rest = (time - self._model_time) * FINE // STEP
        travel: Steps = (self._x >> 8) + (((self._v >> 8) * rest) >> 8)
        return travel
