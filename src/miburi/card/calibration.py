"""Finds out what a card's servos are like, from free motion, and derives their guards for the rule.

The card makes moves while nobody touches the robot, and tells every reading of its encoders; what
follows from those is :mod:`miburi.calibration.free_motion`'s, for this card as for the simulated
servos.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from miburi.calibration.file import Calibration
from miburi.calibration.free_motion import Response, Trace, calibrate, response
from miburi.card.card import Card
from miburi.card.settings import (
    ALLOWED,
    STEPS_PER_TURN,
    CardSettings,
    real_acceleration,
    real_speed,
    shown,
)
from miburi.errors import BodyError
from miburi.robot import JOINTS, Array, Robot
from miburi.robot.guards import GUARDS
from miburi.safety.contact import Rule
from miburi.safety.move import Move, synchronised
from miburi.safety.profile import Profile, Steps, to_steps
from miburi.safety.stop import Phase

__all__ = [
    "Measured",
    "changes",
    "find_zero",
    "free_moves",
    "granted",
    "in_words",
    "loaded",
    "measure",
    "record",
]

#: Where a joint goes: so much of half its range, to both sides of the middle (ours).
_REACH = 0.35
#: How fast, in rad/s; the last is above every servo's speed (ours).
_SPEEDS = (0.8, 2.5, np.inf)
#: How long a move of all joints takes, s; the last is shorter than any servo can (ours).
_DURATIONS = (1.5, 0.8, 0.1)
#: Slow speeds, over so many rad: where an encoder's step is a large part of what is judged (ours).
_SLOWLY, _BIT = (0.05, 0.1, 0.2, 0.4), 0.15
#: s for which the servos are watched after each move: longer than the rule waits for them.
_AFTER = 0.3
_DEGREES = 360 / STEPS_PER_TURN
#: Motors that all answered a reading.
_ALL = 0xFF


@dataclass(frozen=True)
class Measured:
    """A card's servos: how they answer, how many moves told so, and settings with their guards."""

    response: Response
    moves: int
    settings: CardSettings


def free_moves(robot: Robot) -> Iterator[tuple[str, Move]]:
    """Yield what is moved and the move: each joint to and fro; then all at once, slow to fast.

    They begin and end at neutral. Between, joints that rest are in the middle of their ranges,
    where the arms are off the body and off each other.
    """
    middle, half = (robot.lower + robot.upper) / 2, (robot.upper - robot.lower) / 2 * _REACH
    yield "all joints", _move(robot, middle, _SPEEDS[0])
    for motor, name in enumerate(JOINTS):
        only = np.arange(len(JOINTS)) == motor
        for speed in (_SPEEDS[0], _SPEEDS[-1]):
            for side in (-1.0, 1.0):
                yield name, _move(robot, middle + side * half * only, speed)
        yield name, _move(robot, middle, _SPEEDS[1])
    # Both arms do the same, so that they do not meet: the left one's lower joints count backwards.
    alike = np.where([name in ("left_elbow", "left_fingertip") for name in JOINTS], -1.0, 1.0)
    for speed in _SLOWLY:
        for bit in (_BIT, 0.0):
            yield "all joints", _move(robot, middle + alike * bit, speed)
    # As in gestures: they leave together and arrive together.
    here = middle
    for duration in _DURATIONS:
        for side in (-1.0, 1.0):
            there = middle + side * alike * half
            yield "all joints", synchronised(robot, here, there, duration)
            here = there
    yield "all joints", synchronised(robot, here, robot.neutral, _DURATIONS[0])


def _move(robot: Robot, angles: Array, speed: float) -> Move:
    return Move(np.array(angles), np.full(len(JOINTS), min(speed, robot.servo.max_speed)))


def record(card: Card, moves: Iterable[Move]) -> list[Trace]:
    """Let an idle card make free moves, and return what it saw of them.

    Raises
    ------
    BodyError
        A move was stopped.
    """
    return [_record_one(card, move) for move in moves]


def _record_one(card: Card, move: Move) -> Trace:
    origin, reports = np.array(card.goals), [card.report]
    told, card.on_report = card.on_report, reports.append
    try:
        card.move(move)
        while card.step(0.02).phase is Phase.MOVING:
            pass
        stop = card.state.stop
        if stop is not None:
            where = "" if stop.motor is None else f" ({stop.motor})"
            hint = "Give the robot room, keep hands away, and" if stop.sign else "Mend that, and"
            raise BodyError(f"Stopped: {stop.reason.spoken}{where}. {hint} calibrate again.")
        card.step(_AFTER)
    finally:
        card.on_report = told
    way = np.array(card.goals) - origin
    profile = _profile(card, np.abs(way), move)
    before = [report for report in reports if report.time <= card.move_began]
    # The card judges no reading in which a motor was missing.
    seen = [r for r in reports if r.time > card.move_began and r.heard == _ALL]
    return Trace(
        profile,
        start=np.array(before[-1].positions),
        direction=np.where(way < 0, -1, 1),
        times=np.array([report.time - card.move_began for report in seen]),
        positions=np.array([report.positions for report in seen]),
    )


def _profile(card: Card, distance: Steps, move: Move) -> Profile:
    """Return what the card commands for a move, in the servos' own units."""
    general = card.settings.general
    speeds = np.minimum(to_steps(card.robot, move.speeds), general.max_speed)
    return Profile.plan(
        distance,
        np.array([real_speed(speed) for speed in speeds.tolist()]),
        np.full(len(JOINTS), real_acceleration(general.acceleration)),
    )


def measure(card: Card, tell: Callable[[str], None] = lambda _: None) -> Measured:
    """Move an awake or stopped card's joints freely, and give it the guards that they need.

    Meanwhile the rule is on with generous guards. In the end the card is stopped.

    Raises
    ------
    BodyError
        A move was stopped, or a servo needs more than the card grants; the card has then the
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
        calibrated = granted(card.robot, settings, traces)
        _check(calibrated)
    except BaseException:
        with suppress(BodyError):
            card.stop()
            card.configure(settings)
        raise
    card.stop()
    card.configure(calibrated)
    return Measured(response(traces), len(moves), calibrated)


def granted(robot: Robot, settings: CardSettings, traces: list[Trace]) -> CardSettings:
    """Return a card's settings with the guards that its servos need, after a few free moves.

    They are never less than the description's: fifty moves, at one state of the battery and under
    one load, do not show all that such servos do.
    """
    general = settings.general
    guards = calibrate(
        traces,
        robot.servo.step,
        period=general.period,
        ratio=general.ratio,
    )
    shipped = vars(Rule.of(robot).guards)
    enough = {
        name: np.maximum(values, shipped[name])
        for name, values in vars(guards).items()
        if GUARDS[name].floor
    }
    guards = replace(guards, **enough)
    return settings.with_rule(Rule(guards, general.period, general.ratio))


def _check(settings: CardSettings) -> None:
    for name, joint in zip(JOINTS, settings.joints, strict=True):
        for guard, needed in vars(joint.guards).items():
            most = ALLOWED[guard][1]
            if needed > most:
                raise BodyError(
                    f"{name} would need a {guard} of {shown(guard, needed)}, and the card grants "
                    f"no more than {shown(guard, most)}. Look for a loose horn or screw, a cable "
                    "that pulls, or a hand in the way; then calibrate again."
                )


def in_words(measured: Measured) -> list[str]:
    """Say a line for each joint: lag, ramp and noise, and what follows from them."""
    found = measured.response
    return [
        f"{name:>15}: lag {found.lag[i] / 1000:.0f} ms, ramp × {found.ramp[i]:.2f}, "
        f"noise {found.noise[i]:.1f} steps; guards: "
        + ", ".join(f"{guard} {shown(guard, n)}" for guard, n in vars(joint.guards).items())
        for i, (name, joint) in enumerate(zip(JOINTS, measured.settings.joints, strict=True))
    ]


def loaded(settings: CardSettings, calibration: Calibration) -> CardSettings:
    """Return a card's settings with those of a calibration; without a mounting, its own stays."""
    settings = settings.with_rule(calibration.rule)
    return settings if calibration.servos is None else settings.with_mounting(calibration.servos)


def changes(before: CardSettings, after: CardSettings) -> list[str]:
    """Say in words how two cards' calibrations differ, a line for all joints and one for each."""
    names = ("all joints", *JOINTS)
    olds, news = (
        [vars(settings.general), *(joint.values for joint in settings.joints)]
        for settings in (before, after)
    )
    said = []
    for name, old, new in zip(names, olds, news, strict=True):
        parts = [
            f"{field} {shown(field, value)} → {shown(field, new[field])}"
            for field, value in old.items()
            if value != new[field]
        ]
        if parts:
            said.append(f"{name:>15}: {', '.join(parts)}")
    return said


def find_zero(
    settings: CardSettings, motor: int, at_zero: int, turned: int, angle: int
) -> CardSettings:
    """Return settings with a joint's zero and direction found by hand.

    Parameters
    ----------
    at_zero, turned
        The servo's own position at joint angle 0, and after the joint was turned the positive way.
    angle
        Steps that it should have turned at least, to be sure.

    Raises
    ------
    BodyError
        It was turned too little.
    """
    if abs(turned - at_zero) < angle:
        raise BodyError(
            f"{JOINTS[motor]} was turned by {abs(turned - at_zero) * _DEGREES:.1f}° only; turn it "
            f"by at least {angle * _DEGREES:.1f}°."
        )
    joints = list(settings.joints)
    direction = 1 if turned > at_zero else -1
    joints[motor] = replace(joints[motor], zero=at_zero, direction=direction)
    return replace(settings, joints=tuple(joints))
