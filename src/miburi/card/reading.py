"""Translate a card's report into a body's state: phase, stop, compared travel and motors."""

import struct

import numpy as np

from miburi.bodies.base import Motor, Motors
from miburi.card.link import Reason, Report
from miburi.card.settings import CardSettings
from miburi.card.units import STEPS_PER_TURN
from miburi.robot import JOINTS
from miburi.safety.contact import Contact, Sign, Window
from miburi.safety.profile import Steps
from miburi.safety.stop import Phase, Stop, StopReason

#: The card's phases, by their numbers.
PHASES = tuple(Phase)
#: Why a card cannot be released, and what to do about it.
_UNREADY = {
    Reason.SILENT: "servo does not answer; check its plug, its id and the supply",
    Reason.DEAF: "servo does not accept commands; switch the servos off and on",
    Reason.FAULTY: "servo reported a hardware error and was restarted; let it cool",
    Reason.HOT: "servo is too hot; let it cool",
    Reason.LOW_VOLTAGE: "supply voltage is too low; use a stronger supply or thicker wires",
    Reason.ASTRAY: "servo reports an impossible position; check its cable, switch it off and on",
    Reason.MISNAMED: "servo answers with the id of another; assign it its own (calibrate --ids)",
}
_REASONS = {
    Reason.STARTED: StopReason.CARD_STARTED,
    Reason.ASKED: StopReason.ASKED,
    Reason.CONTACT: StopReason.CONTACT,
    Reason.SILENT: StopReason.SERVO_SILENT,
    Reason.DEAF: StopReason.SERVO_DEAF,
    Reason.FAULTY: StopReason.SERVO_FAULTY,
    Reason.HOT: StopReason.SERVO_HOT,
    Reason.LOW_VOLTAGE: StopReason.LOW_VOLTAGE,
    Reason.ASTRAY: StopReason.SERVO_ASTRAY,
    Reason.MISNAMED: StopReason.SERVO_MISNAMED,
    Reason.RESTARTED: StopReason.SERVO_RESTARTED,
    # Here the card has lost the line: it has heard nothing from the host for half a minute.
    Reason.ALONE: StopReason.LINE_LOST,
    Reason.TOUCHED: StopReason.TOUCHED,
}
_SIGNS = tuple(Sign)


def stop_of(report: Report, time: float) -> Stop | None:
    """Return the present stop, if any; ``time`` is when it began, in s on the body's clock."""
    if not report.reason:
        return None
    contact = _contact_of(report)
    return Stop(
        time=time,
        reason=_REASONS[Reason(report.reason)],
        motor=JOINTS[report.motor] if report.motor < len(JOINTS) else None,
        sign=None if contact is None else contact.sign.value,
        ratio=None if contact is None else contact.ratio,
    )


def window_of(report: Report, settings: CardSettings, share: Steps) -> Window | None:
    """Return the rule's figures for the motor whose contact caused the present stop.

    ``share`` is the share of its guards that each motor was granted in that move, (8,) in 1/256.
    """
    contact = _contact_of(report)
    if contact is None:
        return None
    judged = np.arange(len(JOINTS)) == contact.motor
    slack = settings.joints[contact.motor].guards.slack * int(share[contact.motor])
    with_slack = contact.measured + (slack if contact.sign is Sign.SPEED else 0)
    measured, expected, granted, length = (
        np.where(judged, value, 0)
        for value in (contact.measured, contact.expected, with_slack, contact.length)
    )
    return Window(measured, expected, granted, judged, length)


def unready(detail: bytes, settings: CardSettings) -> str:
    """Say why the card refused a release.

    ``detail`` holds the motor, the reason and, for a joint outside its limits, the joint's place.
    """
    if detail[0] >= len(JOINTS):
        return f"The {_UNREADY[Reason(detail[1])]}. Then try again."
    name, joint = JOINTS[detail[0]], settings.joints[detail[0]]
    if detail[1] != Reason.OUTSIDE:
        return f"{name}: {_UNREADY[Reason(detail[1])]}. Then try again."
    (place,) = struct.unpack_from("<h", detail, 2)
    # The servo counts within one turn: a joint just past the wrap-around seems a whole turn away.
    place = min(
        (place + turn * STEPS_PER_TURN for turn in (-1, 0, 1)),
        key=lambda place: max(joint.min - place, place - joint.max),
    )
    here, low, high = (steps * 360 / STEPS_PER_TURN for steps in (place, joint.min, joint.max))
    return (
        f"{name} stands at {here:.1f}°, outside its limits of {low:.1f}° to {high:.1f}°. Turn it "
        "back by hand while it is limp (Card.relax) or the supply is off. Then try again."
    )


def motors_of(report: Report | None, settings: CardSettings) -> Motors:
    """Return the state of the motors; ``report`` is None for a lost card."""
    return Motors(
        tuple(_motor(report, index, joint.servo) for index, joint in enumerate(settings.joints)),
        settings.rule,
        settings=f"{settings.crc:04x}",
        hottest=settings.general.hottest,
        lowest=settings.general.lowest / 10,
    )


def _motor(report: Report | None, index: int, servo: int) -> Motor:
    if report is None:
        return Motor(servo, answers=False)
    answers = bool(report.heard >> index & 1)
    # A card reports 0 °C and 0 V until it has read a servo's temperature and voltage.
    if not report.voltages[index]:
        return Motor(servo, answers)
    return Motor(servo, answers, report.temperatures[index], report.voltages[index] / 10)


def _contact_of(report: Report) -> Contact | None:
    if report.reason != Reason.CONTACT or report.motor >= len(JOINTS):
        return None
    sign = _SIGNS[report.sign - 1]
    return Contact(report.motor, sign, report.measured, report.expected, report.length)
