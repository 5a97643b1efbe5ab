"""Derive the guards that identified servos need in free moves, now and when warm or worn.

It takes the rule with a model of the servos (:mod:`miburi.calibration.identify`) and
:class:`~miburi.calibration.free_motion.Trace` objects of free moves, and gives that rule with
guards. A calibration measures at one supply voltage and one temperature of the gears. The model of
the identified servos predicts how another supply or temperature would shift each move; the guards
must let the shifted move pass, too. In gears that absorb half of a motor's torque, 25 % more
friction lowers the servo's stiffness by 25 %; in new gears, by 10 %.

Importing this module loads Numba.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from miburi.calibration.free_motion import Trace, measure_need
from miburi.calibration.identify import Identified, expecting, play
from miburi.robot import JOINTS, Robot
from miburi.robot.guards import Guards, in_whole_units
from miburi.safety.contact import UNLOADED
from miburi.safety.free import FreeRule, granted_share
from miburi.safety.profile import FINE, Steps

#: The guards are at least this many times the model's error (our choice): in the free moves, and in
#: the same moves in another state, which the model predicts only in part.
MARGIN, STATE_MARGIN = 1.5, 1.25
#: Friction and supply voltage in other states, as multiples of the calibration's (our choice):
#: gears are stiff when cold, and a supply may give 4.75 to 5.25 V.
STATES = ((1.25, 0.95), (0.75, 1.05))
#: The guards that backlash widens, and how many joints must show backlash before they are widened:
#: more than half of the five joints that carry little load (our choice).
_WIDENED, _MANY = ("slack", "behind", "ahead", "arrival"), 3


def free_rule(robot: Robot, found: Identified, traces: Sequence[Trace]) -> FreeRule:
    """Return the rule for these servos, with the guards that their traces require.

    The guards are no less than the description's; see :func:`granted`. If at least three joints
    show backlash, the guards grow further. Each guard then exceeds the description's by at least
    the median of what the motors need beyond the description's, and the guards for lagging and
    leading also grow by the play itself. The reason is that all gears are equally old, but a load,
    as at the shoulders, presses the teeth together and hides their play.
    """
    least = in_whole_units(robot.guards, robot.servo.step)
    guards = replace(least, lag=np.full(len(JOINTS), found.delay))
    rule = granted(expecting(robot, found, guards), traces)
    seen = play(robot, found) / robot.servo.step
    if np.count_nonzero(seen) < _MANY:
        return rule
    return replace(rule, guards=_loosened(guards, rule.guards, float(np.median(seen[seen > 0]))))


def granted(rule: FreeRule, traces: Sequence[Trace]) -> FreeRule:
    """Return the rule with guards widened, never narrowed, for these moves in every state.

    Guards are at least ``MARGIN`` times the model's error in these moves, and ``STATE_MARGIN``
    times the error that it would have in each of ``STATES``.
    """
    free = [FreeTrace(**vars(trace), rule=rule) for trace in traces]
    guards = _widened(rule, rule.guards, free, MARGIN)
    for friction, voltage in STATES:
        other = _in_state(rule, friction, voltage)
        guards = _widened(rule, guards, _shifted(free, other), STATE_MARGIN)
    return replace(rule, guards=guards)


def _loosened(least: Guards[Steps], guards: Guards[Steps], steps: float) -> Guards[Steps]:
    """Return guards for gears with this many ``steps`` of play.

    Each motor is granted at least the median of what the motors need beyond ``least``, and the play
    on top of that: with the median alone, robots with a play of 0.25° had 17 false stops in 4,000
    trials.
    """
    beyond = {name: vars(guards)[name] - vars(least)[name] for name in _WIDENED}
    wider = {
        name: vars(least)[name] + np.maximum(more, int(np.median(more)))
        for name, more in beyond.items()
    }
    for name in ("behind", "ahead"):
        wider[name] = wider[name] + round(steps)
    return replace(guards, **wider)


def shaken(rule: FreeRule, traces: Sequence[Trace]) -> FreeRule:
    """Return a rule that tolerates how motors shake one another in these free moves.

    These moves shake harder than gestures do. The guards ``behind`` and ``ahead`` grow to what
    these moves need, times the usual margins. ``slack`` grows only to what the moves need, without
    a margin: with a larger slack, contacts at the waist are noticed too late.
    """
    free = [FreeTrace(**vars(trace), rule=rule) for trace in traces]
    slack = _widened(rule, rule.guards, free, 1.0).slack
    wider = granted(rule, traces).guards
    guards = replace(rule.guards, slack=slack, behind=wider.behind, ahead=wider.ahead)
    return replace(rule, guards=guards)


def _widened(
    rule: FreeRule, guards: Guards[Steps], traces: Iterable["FreeTrace"], margin: float
) -> Guards[Steps]:
    """Return guards that grant ``margin`` times the model's error in these traces."""
    needs = measure_need(traces, rule.guards.lag, rule.guards.least, rule.period, rule.ratio)
    wider = {
        name: np.maximum(vars(guards)[name], np.ceil(margin * need / FINE).astype(np.int64))
        for name, need in vars(needs).items()
    }
    return replace(guards, **wider)


def _in_state(rule: FreeRule, friction: float, voltage: float) -> FreeRule:
    """Return the rule for the same servos with friction and voltage scaled by these factors."""

    def times(values: Steps, factor: float) -> Steps:
        steps: Steps = np.rint(values * factor).astype(np.int64)
        return steps

    own = rule.servo
    servo = own._replace(
        pull=times(own.pull, voltage),
        friction=times(own.friction, friction),
        lost=times(own.lost, friction),
    )
    return replace(rule, servo=servo, sag=times(rule.sag, 1 / voltage))


def _shifted(traces: Sequence["FreeTrace"], other: FreeRule) -> Iterator["FreeTrace"]:
    """Yield free moves as they would have been with the servos that another rule expects.

    A calibration's own moves do not allow for worn gears, and leave the motors little torque to
    spare. Later moves are planned with limits of duty that not even warm or worn motors reach, so
    the predicted shift assumes motors without limits.
    """
    for trace in traces:
        free = replace(trace, loading=replace(trace.loading, most=UNLOADED.most))
        away = replace(free, rule=other).expected_travel - free.expected_travel
        steps = np.rint(away / FINE).astype(np.int64) * trace.direction
        yield replace(trace, positions=trace.positions + steps)


@dataclass(frozen=True)
class FreeTrace(Trace):
    """A trace to be compared with the model of a free servo instead of the delayed profile.

    Attributes
    ----------
    rule
        The rule with the model of the free servo.
    """

    rule: FreeRule = field(kw_only=True)

    @property
    def granted(self) -> Steps:
        """The share of its guards that the rule grants each motor in this move, (8,), in 1/256."""
        return granted_share(self.profile)

    @property
    def goal(self) -> Steps:
        """The travel at which each motor comes to rest, (8,) in 1/256 steps."""
        loading = self.loading
        return self.profile.distance * FINE + loading.offset - ((loading.end * self.rule.sag) >> 8)

    def expected(self, lag: Steps) -> Steps:  # noqa: ARG002  (the rule has a lag)
        """Return the travel of the free servo at each reading, (n, 8)."""
        return self.expected_travel

    @cached_property
    def expected_travel(self) -> Steps:
        """The travel of the free servo at each reading, (n, 8) in 1/256 steps."""
        watch = self.rule.watch(self.profile, self.start, self.direction, self.loading)
        return np.array([watch.expected_travel(time) for time in self.times.tolist()])
