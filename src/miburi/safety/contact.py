"""The contact rule of Section 2: the reference that the firmware equals, decision for decision.

The paper: every p = 0.1 s each motor's speed is worked out from its positions; if one motor is
slower than 0.9372 of the speed sent to it, the robot has met an obstacle and all motors stop
(Eqs. 1 and 2, Fig. 1).

Compared with the nominal speed alone, that rule stops every free move: a motor ramps up, ramps
down, and follows its command with a lag. So the reference keeps p, the ratio and "one motor
stops all", and compares with the travel that the *commanded profile*, ramps included, should
have brought in the same time, delayed by the servo's lag. What it adds (all ours):

- a motor is judged at every reading of the encoders, over its travel since the last period's
  end: nobody has to wait for the end of a period who is hit at its beginning;
- a motor that should have moved less than ``least`` since then is judged later, over a longer
  window: one encoder step is too coarse a measure for a slow motion;
- ``slack`` steps may always be missing: an encoder step, and the play of the gears;
- two backstops: a motor may never be further than ``behind`` or ``ahead`` from where it should
  be, and must be within ``arrival`` of its goal one period after its profile has ended. A lag
  varies from move to move: on top, a move is granted what ``LAG_DOUBT`` is at its top speed.

:mod:`miburi.safety.printed` keeps the paper's rule to the letter, for comparison.

All quantities are integers, in units of an encoder step and µs, as on the card.
"""

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from miburi.robot import JOINTS, Robot
from miburi.robot.guards import Guards, in_whole_units
from miburi.safety.profile import FINE, SECOND, Profile, Steps

__all__ = [
    "LAG_DOUBT",
    "PAPER_PERIOD",
    "PAPER_RATIO",
    "UNLOADED",
    "Contact",
    "Flags",
    "Loading",
    "Rule",
    "Sign",
    "Watch",
    "Window",
    "lag_doubt",
    "worst",
]

Flags = NDArray[np.bool_]

#: Eq. 2's limit in parts of 10 000.
PAPER_RATIO = 9372
#: Eq. 1's period, in µs.
PAPER_PERIOD = SECOND // 10
#: By how much a servo's lag may differ from move to move, in µs (ours).
LAG_DOUBT = 2000
_NONE = np.zeros(8, dtype=np.bool_)
_READINGS = np.arange(20, dtype=np.int64) * (SECOND // 100)


@dataclass(frozen=True)
class Loading:
    """What bears on the motors during one move, along each one's way: (8,) in 1/256 steps.

    Attributes
    ----------
    offset
        From where the motor is at the start to the origin of its profile.
    begin, end
        The error of position that the load takes at the move's beginning, and at its end.
    most
        The error at which the duty has its limit.
    """

    offset: Steps
    begin: Steps
    end: Steps
    most: Steps


_NOTHING = np.zeros(8, dtype=np.int64)
#: No weight, no limit, and a profile that begins where the motors are.
UNLOADED = Loading(_NOTHING, _NOTHING, _NOTHING, np.full(8, 1 << 20, dtype=np.int64))


@dataclass(frozen=True)
class Rule:
    """Period p in µs, ratio in parts of 10 000 (Eqs. 1 and 2), and the servo's guards."""

    guards: Guards[Steps]
    period: int = PAPER_PERIOD
    ratio: int = PAPER_RATIO

    @classmethod
    def of(cls, robot: Robot) -> "Rule":
        """Return the paper's period and ratio with the guards of the robot's servo."""
        return cls(in_whole_units(robot.guards, robot.servo.step))

    def watch(
        self, profile: Profile, start: Steps, direction: Steps, loading: Loading = UNLOADED
    ) -> "Watch":
        """Begin to watch one move; see :class:`Watch`."""
        return Watch(self, profile, start, direction, loading)


class Sign(StrEnum):
    """By what the rule knew a contact."""

    SPEED = "speed"
    TRACKING = "tracking"
    ARRIVAL = "arrival"


@dataclass(frozen=True)
class Contact:
    """Why the motors were stopped.

    Attributes
    ----------
    motor
        Index of the motor in the order of ``JOINTS``.
    sign
        Which part of the rule saw it.
    measured, expected
        Travel in the judged window (sign speed) or since the move's start (backstops), in
        1/256 steps.
    length
        µs in which the motor travelled so.
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
    """What one reading compared: travel in the judged window, or since the move's start.

    The latter only where a backstop saw a contact; it judges the motors that it saw, and grants
    no slack.

    Attributes
    ----------
    measured, expected
        (8,) travel in 1/256 steps.
    granted
        (8,) the measured travel with the slack: what is held against the expected.
    judged
        (8,) whether the motor was judged: for one, because enough was expected of it.
    length
        (8,) µs over which the motor was looked at.
    """

    measured: Steps
    expected: Steps
    granted: Steps
    judged: Flags
    length: Steps


@dataclass
class Watch:
    """The rule's view of one move; :meth:`look` at each reading of the encoders.

    Attributes
    ----------
    rule
        Period, ratio and guards.
    profile
        The commanded motion of the eight motors.
    start, direction
        (8,) positions in steps when the move began; (8,) +1 or −1.
    loading
        What bears on the motors; the delayed profile does not look at it.
    window
        What the latest reading compared; None before the first.
    """

    rule: Rule
    profile: Profile
    start: Steps
    direction: Steps
    loading: Loading = UNLOADED
    window: Window | None = field(init=False, default=None)
    _expected: Steps = field(init=False)
    _measured: Steps = field(init=False)
    _since: Steps = field(init=False)
    _period_ends: int = field(init=False)
    _end: int = field(init=False)
    _due_soon: dict[int, Steps] = field(init=False, default_factory=dict)

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

    def look(self, positions: Steps, time: int) -> Contact | None:
        """Judge the motors' positions (8,) at ``time`` µs since the move began.

        Returns
        -------
        The contact, named after the motor that fell furthest behind, or None.
        """
        expected, measured = self._due(time), self._travel(positions)
        should, did = expected - self._expected, measured - self._measured
        judged, granted = should >= self._least, did + self._slack
        self.window = Window(did, should, granted, judged, time - self._since)
        if time >= self._period_ends:
            self._period_ends += self.rule.period
            self._expected = np.where(judged, expected, self._expected)
            self._measured = np.where(judged, measured, self._measured)
            self._since = np.where(judged, time, self._since)
        slow = judged & (granted * 10_000 < should * self.rule.ratio)
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
        """Whether every profile has ended and every motor is at its goal."""
        if time < self._end:
            return False
        return bool(np.all(np.abs(self._goal - self._travel(positions)) <= self._arrival))

    def _due(self, time: int) -> Steps:
        """Travel that the profile should have brought, (8,)."""
        if time not in self._due_soon:
            # Worked out for some regular readings at once, which costs hardly more than one.
            times = time + _READINGS
            due = self.profile.position(times[:, None] - self.rule.guards.lag)
            self._due_soon = dict(zip(times.tolist(), due, strict=True))
        return self._due_soon[time]

    def _travel(self, positions: Steps) -> Steps:
        return (positions - self.start) * self.direction * FINE


def lag_doubt(profile: Profile) -> Steps:
    """Return what ``LAG_DOUBT`` is at the top speed of each motor's move, (8,) in 1/256 steps."""
    return profile.fastest * FINE * LAG_DOUBT // SECOND


def worst(sign: Sign, suspects: Flags, window: Window) -> Contact:
    """Name the suspect with the largest shortfall; of equals, the first in the paper's order."""
    shortfall = np.where(suspects, np.abs(window.expected - window.measured), -1)
    motor = int(np.argmax(shortfall))
    measured, expected, length = (
        int(values[motor]) for values in (window.measured, window.expected, window.length)
    )
    return Contact(motor, sign, measured, expected, length)
