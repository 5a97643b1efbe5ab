"""Calibrate a card: measure how its servos move freely, and derive the guards of the rule.

In goes a connected :class:`~miburi.card.card.Card` whose robot nobody touches; out come settings
with new guards. :func:`measure` makes the moves and records every reading of the encoders;
:mod:`miburi.calibration.free_motion` computes the guards, as it does for simulated servos.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from miburi.calibration.file import Calibration
from miburi.calibration.free_motion import Response, Trace, measure_need, measure_response
from miburi.card.card import Card
from miburi.card.settings import (
    ALLOWED,
    STEPS_PER_TURN,
    CardSettings,
    format_value,
)
from miburi.errors import BodyError
from miburi.robot import JOINTS, Array, Robot
from miburi.robot.guards import Guards
from miburi.safety.free import FreeRule, granted_share
from miburi.safety.move import Move, plan_move
from miburi.safety.profile import FINE, Steps
from miburi.safety.stop import Phase

__all__ = [
    "Measurement",
    "apply_calibration",
    "changes",
    "find_zero",
    "free_moves",
    "grant_guards",
    "in_words",
    "measure",
    "record",
]

#: How far a joint moves to both sides of the middle, as a share of half its range; at top speed
#: so much farther that it gets there and stays for a while, but no farther than that (ours).
_REACH, _RUN, _FARTHEST = 0.35, 1.1, 0.97
#: Speeds of single joints, rad/s; the last is above that of every servo (ours).
_SPEEDS = (0.8, 2.5, np.inf)
#: Durations of moves of all joints, s; the last is too short for every servo (ours).
_DURATIONS = (1.5, 0.8, 0.1)
#: Slow speeds, rad/s, and their distance, rad: here one encoder step matters most (ours).
_SLOWLY, _BIT = (0.05, 0.1, 0.2, 0.4), 0.15
#: Recording time after each move, s; longer than the rule waits for a motor to arrive.
_AFTER = 0.3
#: Guards are this many times what free motion missed of the model (ours).
_MARGIN = 1.5
_DEGREES = 360 / STEPS_PER_TURN
#: ``Report.heard`` where all motors answered.
_ALL = 0xFF


@dataclass(frozen=True)
class Measurement:
    """The result of a calibration: how the servos respond, the number of moves, new settings."""

    response: Response
    moves: int
    settings: CardSettings


def free_moves(robot: Robot) -> Iterator[tuple[str, Move]]:
    """Yield the moves of a calibration, each with the name of the joint that moves.

    First each joint moves to and fro, then all move at once, slow to fast. The moves begin and end
    at neutral. A resting joint is in the middle of its range, where the arms touch neither the
    body nor each other. To be as fast as its servo may be, a joint needs a way of v²/a; elbows and
    fingertips have little more between their limits.
    """
    middle, half = (robot.lower + robot.upper) / 2, (robot.upper - robot.lower) / 2
    run = _RUN * robot.servo.max_speed**2 / robot.servo.acceleration
    far = np.minimum(np.maximum(run / 2, _REACH * half), _FARTHEST * half)
    half = _REACH * half
    yield "all joints", _move(robot, middle, _SPEEDS[0])
    for motor, name in enumerate(JOINTS):
        only = np.arange(len(JOINTS)) == motor
        for speed, way, sides in (
            (_SPEEDS[0], half, (-1.0, 1.0)),
            (_SPEEDS[-1], far, (-1.0, 1.0, -1.0)),
        ):
            for side in sides:
                yield name, _move(robot, middle + side * way * only, speed)
        yield name, _move(robot, middle, _SPEEDS[1])
    # Both arms do the same, so that they do not meet; the left one's lower joints are mirrored.
    alike = np.where([name in ("left_elbow", "left_fingertip") for name in JOINTS], -1.0, 1.0)
    for speed in _SLOWLY:
        for bit in (_BIT, 0.0):
            yield "all joints", _move(robot, middle + alike * bit, speed)
    # As in gestures, all joints start together and arrive together.
    here = middle
    for duration in _DURATIONS:
        for side in (-1.0, 1.0):
            there = middle + side * alike * half
            yield "all joints", plan_move(robot, here, there, duration)
            here = there
    yield "all joints", plan_move(robot, here, robot.neutral, _DURATIONS[0])


def _move(robot: Robot, angles: Array, speed: float) -> Move:
    return Move(np.array(angles), np.full(len(JOINTS), min(speed, robot.servo.max_speed)))


def record(card: Card, moves: Iterable[Move]) -> list[Trace]:
    """Let an idle card make free moves, and return a trace of each.

    Raises
    ------
    BodyError
        A move was stopped.
    """
    return [_record_one(card, move) for move in moves]


def _record_one(card: Card, move: Move) -> Trace:
    origin, reports = np.array(card.goals), [card.report]
    previous, card.on_report = card.on_report, reports.append
    try:
        card.move(move)
        while card.step(0.02).phase is Phase.MOVING:
            pass
        stop = card.state.stop
        if stop is not None:
            where = "" if stop.motor is None else f" ({stop.motor})"
            hint = "Give the robot room, keep hands away, and" if stop.sign else "Mend that, then"
            raise BodyError(f"Stopped: {stop.reason.spoken}{where}. {hint} calibrate again.")
        card.step(_AFTER)
    finally:
        card.on_report = previous
    before = [report for report in reports if report.time <= card.move_began]
    # The card does not judge readings that a motor did not answer.
    complete = [r for r in reports if r.time > card.move_began and r.heard == _ALL]
    start, order = np.array(before[-1].positions), card.order
    if order is None:
        raise BodyError("The card made no move; connect to it again.")
    profile, direction = order.profile(card.settings, origin)
    return Trace(
        profile,
        start,
        direction,
        times=np.array([report.time - card.move_began for report in complete]),
        positions=np.array([report.positions for report in complete]),
        loading=order.loading(card.settings, start, origin),
    )


def measure(card: Card, tell: Callable[[str], None] = lambda _: None) -> Measurement:
    """Move every joint of a card freely, and configure the card with the guards that it needs.

    The contact rule stays on, with generous guards. The card may be idle or stopped before, and
    is stopped afterwards. ``tell`` is called with a line about each stage.

    Raises
    ------
    BodyError
        A move was stopped, or a servo needs more than the card allows. The card then has the
        guards that it had before.
    """
    settings, moves = card.settings, list(free_moves(card.robot))
    card.stop()
    try:
        card.configure(settings.generous)
        card.wake()
        traces: list[Trace] = []
        for index, (name, move) in enumerate(moves):
            if index == 0 or name != moves[index - 1][0]:
                tell(f"moving {name.replace('_', ' ')}")
            traces += record(card, [move])
        calibrated = grant_guards(card.robot, settings, traces)
        _check(calibrated)
    except BaseException:
        with suppress(BodyError):
            card.stop()
            card.configure(settings)
        raise
    card.stop()
    card.configure(calibrated)
    return Measurement(measure_response(traces), len(moves), calibrated)


def grant_guards(robot: Robot, settings: CardSettings, traces: list[Trace]) -> CardSettings:
    """Return a card's settings with the guards that its servos need in these traces.

    Each guard is 1.5 times what the free servo's model missed, but no less than for servos
    that nobody has calibrated: fifty moves, with one state of the battery and one load, do not show
    everything that such servos do.
    """
    rule = settings.rule
    own = rule.guards
    floors = replace(FreeRule.of(robot).guards, lag=own.lag, least=own.least)
    guards = vars(floors)
    for trace in traces:
        free = _FreeTrace(**vars(trace), rule=rule)
        need = vars(measure_need([free], own.lag, own.least, rule.period, rule.ratio))
        for name, needed in need.items():
            share = FINE if name == "arrival" else granted_share(trace.profile)
            enough = np.ceil(needed * _MARGIN / share).astype(np.int64)
            guards = guards | {name: np.maximum(guards[name], enough)}
    return settings.with_rule(replace(rule, guards=Guards(**guards)))


@dataclass(frozen=True)
class _FreeTrace(Trace):
    """A trace that is held against the free servo."""

    rule: FreeRule = field(kw_only=True)

    def expected(self, lag: Steps) -> Steps:
        never = np.full_like(lag, 1 << 40)
        blind = replace(self.rule, guards=Guards(lag, never, never, never, never, never))
        watch = blind.watch(self.profile, self.start, self.direction, self.loading)
        expected = []
        for time in self.times.tolist():
            watch.look(self.start, time)
            # A window in which nothing is judged begins with the move.
            expected.append(watch.start if watch.window is None else watch.window.expected)
        return np.array(expected)


def _check(settings: CardSettings) -> None:
    for name, joint in zip(JOINTS, settings.joints, strict=True):
        for guard, needed in vars(joint.guards).items():
            most = ALLOWED[guard][1]
            if needed > most:
                raise BodyError(
                    f"{name} needs a {guard} of {format_value(guard, needed)}; the card allows at "
                    f"most {format_value(guard, most)}. Look for a loose horn or screw, a cable "
                    "that pulls, or a hand in the way; then calibrate again."
                )


def in_words(measured: Measurement) -> list[str]:
    """Return a line of text for each joint: lag, ramp and noise, and the guards."""
    response = measured.response
    return [
        f"{name:>15}: lag {response.lag[i] / 1000:.0f} ms, ramp × {response.ramp[i]:.2f}, "
        f"noise {response.noise[i]:.1f} steps; guards: "
        + ", ".join(f"{guard} {format_value(guard, n)}" for guard, n in vars(joint.guards).items())
        for i, (name, joint) in enumerate(zip(JOINTS, measured.settings.joints, strict=True))
    ]


def apply_calibration(settings: CardSettings, calibration: Calibration) -> CardSettings:
    """Return a card's settings with a calibration's rule and, if it has one, its mounting."""
    settings = settings.with_rule(calibration.rule)
    return settings if calibration.servos is None else settings.with_mounting(calibration.servos)


def changes(before: CardSettings, after: CardSettings) -> list[str]:
    """Return a line of text for all joints, and one for each joint, whose settings differ."""
    names = ("all joints", *JOINTS)
    olds, news = (
        [vars(settings.general), *(joint.values for joint in settings.joints)]
        for settings in (before, after)
    )
    lines = []
    for name, old, new in zip(names, olds, news, strict=True):
        parts = [
            f"{field} {format_value(field, value)} → {format_value(field, new[field])}"
            for field, value in old.items()
            if value != new[field]
        ]
        if parts:
            lines.append(f"{name:>15}: {', '.join(parts)}")
    return lines


def find_zero(
    settings: CardSettings, motor: int, at_zero: int, turned: int, angle: int
) -> CardSettings:
    """Return settings with the zero and direction of a joint that somebody turned by hand.

    Parameters
    ----------
    at_zero, turned
        The servo's position at joint angle 0, and after the joint was turned in its positive
        direction.
    angle
        The least turn, in steps, that shows the direction reliably.

    Raises
    ------
    BodyError
        The joint was turned by less than ``angle``.
    """
    if abs(turned - at_zero) < angle:
        raise BodyError(
            f"{JOINTS[motor]} was turned by only {abs(turned - at_zero) * _DEGREES:.1f}°; turn it "
            f"by at least {angle * _DEGREES:.1f}°."
        )
    joints = list(settings.joints)
    direction = 1 if turned > at_zero else -1
    joints[motor] = replace(joints[motor], zero=at_zero, direction=direction)
    return replace(settings, joints=tuple(joints))
