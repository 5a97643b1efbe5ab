"""The moves and readings from which the bench's measurements are made."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from miburi.card.card import Card, wake
from miburi.card.link import FrameKind, Report
from miburi.card.order import Order
from miburi.robot import JOINTS, Array, Robot
from miburi.safety.free import FreeRule
from miburi.safety.move import Move
from miburi.safety.profile import FINE
from miburi.safety.stop import Phase

#: The speed of the moves to a pose, in rad/s. Then two times in s: how long the body settles after
#: such a move, and how long its positions are read.
GENTLY, REST, LOOK = 0.8, 1.5, 0.5

#: The joint that carries the test weights. Then how far poses stay from the joints' limits, in rad,
#: and how many angles to try for each joint.
ELBOW, CLEAR, GRID = JOINTS.index("right_elbow"), 0.35, 40

#: A weight makes the elbow sag by more than a message to the card can hold. So a third of the sag
#: is sent, and the card multiplies it by three.
DEEPER = 3


def peek(card: Card, motor: int, address: int, count: int) -> int:
    """Return the number that ``count`` (1 to 12) registers of a servo hold, from ``address`` on.

    The body must be at rest.

    Raises
    ------
    BodyError
        The body is moving, or the servo does not answer, or it has no such registers.
    """
    held = card.ask(FrameKind.PEEK, bytes((motor, address, count)))
    return int.from_bytes(held, "little", signed=True)


def with_gain(card: Card, gain: float, deeper: int = 1) -> Robot:
    """Set another P gain and wide guards, and release the body; return the robot with that gain.

    The card multiplies the load that is sent for the elbow by ``deeper``.
    """
    servo = card.robot.servo.model
    drive = servo.drive.model_copy(update={"gain": gain})
    robot = card.robot.with_servo(servo.model_copy(update={"drive": drive}))
    card.stop()
    settings = card.settings.with_servos(robot, FreeRule.of(robot)).generous
    joints = list(settings.joints)
    joints[ELBOW] = replace(joints[ELBOW], sag=deeper * FINE)
    card.configure(replace(settings, joints=tuple(joints)))
    wake(card)
    return robot


def go(
    card: Card,
    angles: Array,
    speed: float = GENTLY,
    duty: int | None = None,
    hung: int | None = None,
) -> list[Report]:
    """Make one move; return all reports since its start, even if it was stopped.

    ``duty`` (at most ``FULL_PWM``) replaces the move's own limit on the motors' duty. ``hung`` is
    the elbow's sag under a weight, in quarters of a step. If ``hung`` is given, the elbow's load is
    divided by ``DEEPER`` before it is sent, and the card multiplies it by ``DEEPER`` (see
    :func:`with_gain`).
    """
    move = Move(angles, np.full(len(JOINTS), speed))
    here, origin = np.array(card.report.positions), card.goals
    order = Order.of(card.robot, card.settings, here, origin, move)
    if duty is not None:
        same = np.full(len(JOINTS), duty)
        order = order._replace(pwm=same, cruise=same)
    if hung is not None:
        for told in (order.begin, order.end):
            told[ELBOW] = (told[ELBOW] + hung) // DEEPER
    with listening(card) as reports:
        card.start(order)
        while card.step(0.02).phase is Phase.MOVING:
            pass
    return reports


@contextmanager
def listening(card: Card) -> Iterator[list[Report]]:
    """Collect the card's reports."""
    reports = list[Report]()
    before, card.on_report = card.on_report, reports.append
    try:
        yield reports
    finally:
        card.on_report = before


def positions(reports: list[Report]) -> Array:
    """Return the joints' positions in each of the n reports, (n, 8) steps."""
    return np.array([report.positions for report in reports], dtype=np.float64)


def rest(card: Card) -> Array:
    """Return the angles of the resting joints, (8,) rad, averaged over half a second."""
    card.step(REST)
    with listening(card) as reports:
        card.step(LOOK)
    rest: Array = positions(reports).mean(axis=0) * card.robot.servo.step
    return rest
