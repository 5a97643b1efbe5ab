"""The paper's contact rule (Section 2): if the robot has met something, all motors stop.

The rule takes the commanded profile of one move and then, at every reading of the encoders (10 ms
apart in simulation, 20 ms on the card), the eight motors' positions. It returns a :class:`Contact`,
or None. All quantities are integers, in encoder steps and µs. The firmware's ``contact.h`` makes
the same decision at every reading.

The paper's rule: every p = 0.1 s, compute each motor's speed from its positions. If one motor is
slower than 0.9372 of the speed sent to it, the robot has met an obstacle and all motors stop (Eqs.
1 and 2, Fig. 1).

Miburi's rule compares distances instead of speeds. A motor passes if, in the current window::

    measured travel + slack ≥ 0.9372 × expected travel

The expected travel is that of the commanded profile, ramps included, delayed by the servo's lag.
A window starts at the end of a period and grows with each reading until the next period ends.
For a motor that cruises at 800 steps/s, with a slack of 5 steps::

    reading at [ms]               110      120    ...    200   |    210      220    ...
    window [ms]                 100–110  100–120       100–200 |  200–210  200–220
    expected travel [steps]         8       16            80   |      8       16
    measured travel, at least       3       10            70   |      3       10

So a motor that is blocked at the start of a period stops the robot at the next reading, not at the
end of the period.

Each motor has six guards, which calibration derives from free motion. The figures here are those
of the iphonoid's right shoulder; a step is 0.088°.

1. ``lag``, 5.5 ms: the delay with which the motor follows its profile.
2. ``slack``, 10 steps: the travel that may always be missing from a window, because encoders count
   whole steps and gears have play.
3. ``least``, 8 steps: a window is judged only if at least this travel is expected, because one step
   is too coarse a measure for a slow motion. If less is expected until the end of the period, the
   window is extended: at 50 steps/s it is judged after 160 ms.
4. ``behind``, 12 steps: the motor may never be further than this behind the delayed profile.
5. ``ahead``, 12 steps: it may never be further than this ahead of the delayed profile.
6. ``arrival``, 9 steps: one period after the delayed profile ends, the motor must be this close to
   its goal.

Guards 4 and 5 widen with the speed of the move. A lag varies from move to move by up to
``LAG_DOUBT`` = 2 ms, which adds 6 steps at a top speed of 3000 steps/s.

The rule cannot see an obstacle that holds a motor back by less than its guards. Contacts that are
slow, soft or near a joint's axis are noticed late (docs/safety.md has the figures).

The period, the ratio and "one motor stops all" are the paper's; all else is ours. The printed rule
compares a motor's speed with the nominal speed. A real servo ramps up, ramps down and lags, so the
printed rule would stop all its free moves; :mod:`miburi.safety.printed` keeps it for comparison.
"""

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from miburi.errors import InputError
from miburi.robot import JOINTS, Robot
from miburi.robot.guards import Guards, in_whole_units
from miburi.safety.profile import FINE, SECOND, Profile, Steps

Flags = NDArray[np.bool_]

#: The limit of Eq. 2, in parts of 10 000.
PAPER_RATIO = 9372
#: The period of Eq. 1, in µs.
PAPER_PERIOD = SECOND // 10
#: How much a servo's lag may vary from move to move, in µs (our choice). With 4 ms there were fewer
#: false stops, but one robot in twelve did not notice a force of 9.4 N that held its upper arm.
LAG_DOUBT = 2000
_NONE = np.zeros(8, dtype=np.bool_)
_NOTHING: Steps = np.zeros(8, dtype=np.int64)
_READINGS = np.arange(20, dtype=np.int64) * (SECOND // 100)


@dataclass(frozen=True)
class Loading:
    """How the loads act on the motors in one move.

    All values but ``velocity`` are in 1/256 steps. All have the shape (8,), and count along each
    motor's direction.

    Attributes
    ----------
    offset
        The distance from the motor's position at the start to the origin of its profile.
    begin, end
        The position error that the load causes at the move's beginning, and at its end.
    most
        The error at which the duty reaches its limit.
    velocity
        The motor's speed at the start, in 1/256 steps/s: it may still be swinging from the last
        move.
    gone
        How far the motor has travelled since its position was read.
    """

    offset: Steps
    begin: Steps
    end: Steps
    most: Steps
    velocity: Steps = field(default_factory=lambda: _NOTHING)
    gone: Steps = field(default_factory=lambda: _NOTHING)


#: No weight, no limit, and a profile that begins where the motors are.
UNLOADED = Loading(_NOTHING, _NOTHING, _NOTHING, np.full(8, 1 << 20, dtype=np.int64))


@dataclass(frozen=True)
class Rule:
    """The contact rule, with the delayed profile as the expected motion.

    This class needs wider guards than a description has; a robot's own rule is a
    :class:`miburi.safety.free.FreeRule`. To vary one number, start from that:
    ``replace(FreeRule.of(robot), ratio=9000)``.

    Raises InputError if the period or the ratio is not a whole number in its range.

    Attributes
    ----------
    guards
        The guards of the motors.
    period
        p of Eq. 1, in µs: at least 10 000, the time between two readings.
    ratio
        The least share of the commanded travel (Eq. 2), in parts of 10 000: 0 to 10 000.
    """

    guards: Guards[Steps]
    period: int = PAPER_PERIOD
    ratio: int = PAPER_RATIO

    def __post_init__(self) -> None:
        whole = int | np.integer
        if not (isinstance(self.period, whole) and self.period >= SECOND // 100):
            raise InputError(
                "the rule's period must be a whole number of µs, 10000 or more, such as 100000; "
                f"got {self.period!r}."
            )
        if not (isinstance(self.ratio, whole) and 0 <= self.ratio <= 10_000):
            raise InputError(
                "the rule's ratio must be a whole number from 0 to 10000, such as 9372 for "
                f"0.9372; got {self.ratio!r}."
            )

    @classmethod
    def of(cls, robot: Robot) -> "Rule":
        """Return the paper's period and ratio with the guards of the robot's description.

        These guards are for the rule with a model of the unhindered servo,
        :class:`miburi.safety.free.FreeRule`.
        """
        return cls(in_whole_units(robot.guards, robot.servo.step))

    @property
    def at_rest(self) -> Steps:
        """How far motors at rest may be from where they came to rest, (8,) steps."""
        return np.maximum(self.guards.slack, self.guards.arrival)

    def watch(
        self, profile: Profile, start: Steps, direction: Steps, loading: Loading = UNLOADED
    ) -> "Watch":
        """Begin to watch one move; see :class:`Watch`."""
        return Watch(self, profile, start, direction, loading)


class Sign(StrEnum):
    """The test of the rule that found a contact: the window, or one of its two backstops."""

    SPEED = "speed"
    TRACKING = "tracking"
    ARRIVAL = "arrival"


@dataclass(frozen=True)
class Contact:
    """The contact that stops the motors.

    Attributes
    ----------
    motor
        Index of the motor in the order of ``JOINTS``.
    sign
        The test that found the contact.
    measured, expected
        Travel in 1/256 steps: within the window if the sign is ``speed``, otherwise since the move
        began.
    length
        How long that travel took, in µs.
    """

    motor: int
    sign: Sign
    measured: int
    expected: int
    length: int

    @property
    def name(self) -> str:
        """The motor's full name."""
        return JOINTS[self.motor]

    @property
    def ratio(self) -> float:
        """Measured over expected travel; 0 where nothing was expected."""
        return self.measured / self.expected if self.expected else 0.0


@dataclass(frozen=True)
class Window:
    """The figures that the rule compared at one reading.

    Travel is counted in the window. If a backstop (tracking or arrival) found the contact, travel
    is counted since the move began, without slack, and only the motors that the backstop caught are
    judged.

    Attributes
    ----------
    measured, expected
        (8,) travel in 1/256 steps.
    granted
        (8,) measured travel plus slack; the rule compares this with the expected travel.
    judged
        (8,) whether the motor was judged. In a window, it is judged once the expected travel
        reaches ``least``.
    length
        (8,) how long the travel took, in µs.
    """

    measured: Steps
    expected: Steps
    granted: Steps
    judged: Flags
    length: Steps


@dataclass
class Watch:
    """Watch one move by the rule: call :meth:`look` at each reading of the encoders.

    Attributes
    ----------
    rule
        Period, ratio and guards.
    profile
        The commanded motion of the eight motors.
    start, direction
        ``start`` holds the positions at the latest reading before the move began, (8,) in steps.
        ``direction`` is +1 or −1 for each motor, (8,).
    loading
        The loads on the motors; the delayed profile ignores them.
    window
        The figures of the latest reading; None before the first.
    came
        (8,) steps that each motor had already moved in its present direction, in earlier moves that
        were replaced.
    turned
        (8,) whether the motor went the other way in the move that was replaced.
    """

    rule: Rule
    profile: Profile
    start: Steps
    direction: Steps
    loading: Loading = UNLOADED
    window: Window | None = field(init=False, default=None)
    came: Steps = field(init=False, default_factory=lambda: _NOTHING)
    turned: Flags = field(init=False, default_factory=lambda: _NONE)
    _expected: Steps = field(init=False)
    _measured: Steps = field(init=False)
    _since: Steps = field(init=False)
    _period_ends: int = field(init=False)
    _end: int = field(init=False)
    _offset: Steps = field(init=False, default_factory=lambda: _NOTHING)
    _upcoming: dict[int, Steps] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        guards = self.rule.guards
        self._slack, self._least = guards.slack * FINE, guards.least * FINE
        doubt = lag_doubt(self.profile)
        self._behind, self._ahead = guards.behind * FINE + doubt, guards.ahead * FINE + doubt
        self._arrival = guards.arrival * FINE
        self._goal = self.profile.distance * FINE
        self._late = self.profile.total + guards.lag + self.rule.period
        self._first_late = int(np.min(self._late))
        self._period_ends = self.rule.period
        self._expected = np.zeros_like(self.start)
        self._measured = np.zeros_like(self.start)
        self._since = np.zeros_like(self.start)
        self._end = int(np.max(self.profile.total + self.rule.guards.lag))

    def go_on(self, before: "Watch", seen: int, elapsed: int) -> None:
        """Carry over what was observed during the move that this one replaces.

        A hand that holds a motor back is noticed, however often moves replace one another. Only the
        window of a motor that turns round starts again, at its turning point: otherwise travel in
        both directions would be added up.

        ``before`` is the watch over the earlier move. ``seen`` is the time of the latest reading,
        and ``elapsed`` the time of this move's start, both in µs after the earlier move's start.
        """
        turned = before.direction * self.direction
        moved = (before.start - self.start) * self.direction * FINE
        now = turned * before.expected_travel(seen) + moved
        on = turned > 0
        self._expected = np.where(on, before._expected + moved, now)
        self._measured = np.where(on, before._measured + moved, 0)
        self._since = np.where(on, before._since, seen) - elapsed
        self._period_ends = before._period_ends - elapsed
        # A motor under way is behind its profile.
        self._offset = self.loading.offset
        self._goal = self._goal + self._offset
        self.turned = ~on
        self.came = np.where(on, np.maximum(before.came - moved // FINE, 0), 0)

    def look(self, positions: Steps, time: int) -> Contact | None:
        """Judge the motors' positions (8,) at ``time`` µs since the move began.

        Returns the contact of the motor that deviates most, or None.
        """
        expected, measured = self.expected_travel(time), self._travel(positions)
        window_expected, window_measured = expected - self._expected, measured - self._measured
        back = self.turned & (window_expected < 0)
        if back.any():  # on the way to where it turns
            self._expected = np.where(back, expected, self._expected)
            self._measured = np.where(back, measured, self._measured)
            self._since = np.where(back, time, self._since)
            window_expected = np.where(back, 0, window_expected)
            window_measured = np.where(back, 0, window_measured)
        judged, granted = window_expected >= self._least, window_measured + self._slack
        self.window = Window(window_measured, window_expected, granted, judged, time - self._since)
        if time >= self._period_ends:
            self._period_ends += self.rule.period
            self._expected = np.where(judged, expected, self._expected)
            self._measured = np.where(judged, measured, self._measured)
            self._since = np.where(judged, time, self._since)
        slow = judged & (granted * 10_000 < window_expected * self.rule.ratio)
        behind = expected - measured
        astray = (behind > self._behind) | (-behind > self._ahead)
        missing = _NONE
        if time >= self._first_late:
            missing = (time >= self._late) & (np.abs(self._goal - measured) > self._arrival)
        if not (slow | astray | missing).any():
            return None
        if slow.any():
            return worst(Sign.SPEED, slow, self.window)
        length = np.full_like(measured, time)
        if astray.any():
            self.window = Window(measured, expected, measured, astray, length)
            return worst(Sign.TRACKING, astray, self.window)
        self.window = Window(measured, self._goal, measured, missing, length)
        return worst(Sign.ARRIVAL, missing, self.window)

    def arrived(self, positions: Steps, time: int) -> bool:
        """Return whether every profile has ended and every motor is at its goal."""
        if time < self._end:
            return False
        return bool(np.all(np.abs(self._goal - self._travel(positions)) <= self._arrival))

    def expected_travel(self, time: int) -> Steps:
        """Return the travel of the delayed profile since the move began, (8,) in 1/256 steps."""
        if time not in self._upcoming:
            # Computing twenty regular readings at once takes hardly longer than one.
            times = time + _READINGS
            travels = self.profile.position(times[:, None] - self.rule.guards.lag) + self._offset
            self._upcoming = dict(zip(times.tolist(), travels, strict=True))
        return self._upcoming[time]

    def _travel(self, positions: Steps) -> Steps:
        return (positions - self.start) * self.direction * FINE


def lag_doubt(profile: Profile) -> Steps:
    """Return how far each motor travels in ``LAG_DOUBT`` at its top speed, (8,) in 1/256 steps."""
    return profile.fastest * LAG_DOUBT // SECOND


def worst(sign: Sign, suspects: Flags, window: Window) -> Contact:
    """Return the contact of the suspected motor that deviates most; on a tie, the first."""
    deviation = np.where(suspects, np.abs(window.expected - window.measured), -1)
    motor = int(np.argmax(deviation))
    measured, expected, length = (
        int(values[motor]) for values in (window.measured, window.expected, window.length)
    )
    return Contact(motor, sign, measured, expected, length)
