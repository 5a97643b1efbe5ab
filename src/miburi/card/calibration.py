"""Calibrate a card: identify its servos from free moves, and derive the rule that fits them.

It needs a connected :class:`~miburi.card.card.Card` whose robot is not being touched. It returns
settings and guards that fit the servos of that robot. :func:`measure` makes the moves;
:mod:`miburi.calibration.identify` identifies the servos, as it does for simulated ones.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace

from miburi.calibration.file import Calibration
from miburi.calibration.free_motion import Trace
from miburi.calibration.guards import free_rule, granted, shaken
from miburi.calibration.identify import (
    and_play,
    check,
    expecting,
    fitted,
    identify,
    in_words,
    proposed_gain,
    stiffness,
    worn,
)
from miburi.calibration.shares import Shares
from miburi.card.card import Card, wake
from miburi.card.free_moves import free_moves, gestures, record, swings
from miburi.card.settings import ALLOWED, CardSettings, format_value
from miburi.card.units import STEPS_PER_TURN
from miburi.errors import BodyError
from miburi.robot import JOINTS, Robot
from miburi.safety.drive import uneased
from miburi.safety.free import FreeRule
from miburi.safety.move import Move

#: The gain is checked at most this many times, with moves of all joints between these two speeds
#: (rad/s). Three checks suffice, and every servo reaches these speeds (our choice).
_ROUNDS, _SLOWEST, _FASTEST = 3, 0.15, 2.0
_DEGREES = 360 / STEPS_PER_TURN


@dataclass(frozen=True)
class Measurement:
    """The result of a calibration.

    Attributes
    ----------
    robot, found
        The description with the servos' gain, stiffness and wear, and each servo's constants
        relative to those in the description.
    settings
        The settings that the card has now.
    words
        Sentences for the person who built the robot: what to check, and what has changed.
    moves, seconds
        The number of free moves, and how long the whole calibration took, in s on the robot's
        clock.
    """

    robot: Robot
    found: Shares
    settings: CardSettings
    words: tuple[str, ...]
    moves: int
    seconds: float


def measure(card: Card, tell: Callable[[str], None] = lambda _: None) -> Measurement:
    """Identify a card's servos from moves without contact, and configure the card for them.

    The contact rule stays on, with wide guards; at the end, gestures test the new guards. The card
    may be idle or stopped beforehand, and is stopped afterwards. ``tell`` is called with a line of
    text about each stage.

    Raises
    ------
    BodyError
        A move was stopped, a servo is too soft or too stiff, or a servo needs wider guards than the
        card allows. The card then has its earlier settings again.
    """
    before = card.settings
    card.stop()
    try:
        return _measure(card, tell)
    except BaseException:
        with suppress(BodyError):
            card.stop()
            card.configure(before)
        raise


def _measure(card: Card, tell: Callable[[str], None]) -> Measurement:
    began, robot, general = card.state.time, card.robot, card.settings.general
    rule = replace(FreeRule.of(robot), period=general.period, ratio=general.ratio)
    settings = CardSettings.of(robot, rule).with_mounting(card.settings.mounting)
    moves, count = list(free_moves(robot)), 0
    slow = [
        ("all joints", move)
        for name, move in moves
        if name not in JOINTS and _SLOWEST < move.speeds.max() < _FASTEST
    ]
    for after in reversed(range(_ROUNDS)):
        traces = _trace(card, settings, slow, tell)
        found = identify(robot, traces)
        count += len(slow)
        if not after or proposed_gain(robot, found) == settings.general.p_gain:
            break
        robot = fitted(robot, found)
        settings = settings.with_servos(robot, replace(rule, servo=FreeRule.of(robot).servo))
        tell(f"the P gain is {settings.general.p_gain} now")
    # A duty limit for new gears would be too low for worn ones, and their stiffness would then be
    # underestimated.
    robot, found, _ = worn(robot, found, traces)
    check(robot, found)
    # Moves at full speed follow, for which the contact rule needs the identified servos.
    known = replace(expecting(robot, found, rule.guards), period=rule.period, ratio=rule.ratio)
    traces = _trace(card, settings.with_servos(robot, known), moves, tell)
    found = identify(robot, traces, found.wear)
    check(robot, found)
    words = in_words(robot, found)
    if settings.general.p_gain != CardSettings.of(card.robot).general.p_gain:
        words.insert(0, f"the P gain is {settings.general.p_gain} now: it fits these servos")
    robot, found, traces = worn(robot, found, traces)
    fits = replace(free_rule(robot, found, traces), period=rule.period, ratio=rule.ratio)
    settings = settings.with_servos(robot, fits)
    swinging = [("both arms", move) for move in swings(robot)]
    settings = settings.with_rule(shaken(settings.rule, _trace(card, settings, swinging, tell)))
    _check(settings)
    card.configure(settings)
    try:
        traces = _test(card, tell)
    except BodyError as error:
        if card.state.stop is None or card.state.stop.sign is None:
            raise  # no joint was held, so play cannot be the cause
        raise BodyError(f"{error}{and_play(robot, found)}") from error
    settings = settings.with_rule(granted(settings.rule, traces))
    _check(settings)
    card.configure(settings)
    count += len(moves) + len(swinging)
    return Measurement(robot, found, settings, tuple(words), count, card.state.time - began)


def _trace(
    card: Card,
    settings: CardSettings,
    moves: list[tuple[str, Move]],
    tell: Callable[[str], None],
) -> list[Trace]:
    """Make free moves under generous guards, then stop; return the traces.

    ``tell`` is called with a line of text when the moves of another joint begin.
    """
    card.configure(settings.generous)
    wake(card)
    traces, told = list[Trace](), ""
    for name, move in moves:
        if name != told:
            tell(f"moving {name.replace('_', ' ')}")
        traces += record(card, [move], uneased(card.robot))
        told = name
    card.stop()
    return traces


def _test(card: Card, tell: Callable[[str], None]) -> list[Trace]:
    wake(card)
    traces = list[Trace]()
    for feeling, moves in gestures(card.robot):
        tell(f"testing: {feeling}")
        traces += record(card, moves)
    card.stop()
    return traces


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


def describe(measured: Measurement) -> list[str]:
    """Return a line of text for each joint: the servo that was found, and its guards."""
    own, found = stiffness(measured.robot, measured.found), measured.found
    return [
        f"{name:>15}: {own[i]:.1f} N·m/rad, friction × {found.wear * found.friction[i]:.2f}, "
        f"weight × {found.gravity[i]:.2f}; guards: "
        + ", ".join(f"{guard} {format_value(guard, n)}" for guard, n in vars(joint.guards).items())
        for i, (name, joint) in enumerate(zip(JOINTS, measured.settings.joints, strict=True))
    ]


def apply_calibration(settings: CardSettings, calibration: Calibration) -> CardSettings:
    """Return a card's settings with the rule of a calibration, and with its servos, if any."""
    if calibration.identified is None:
        settings = settings.with_rule(calibration.rule)
    else:
        settings = settings.with_servos(calibration.robot, calibration.identified)
    return settings if calibration.servos is None else settings.with_mounting(calibration.servos)


def changes(before: CardSettings, after: CardSettings) -> list[str]:
    """Return lines about settings that differ: one for all joints together, and one for each."""
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

    ``at_zero`` and ``turned`` are the servo's positions at joint angle 0 and after a turn in the
    joint's positive direction. ``angle`` is the least turn, in steps, that shows the direction
    reliably.

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
