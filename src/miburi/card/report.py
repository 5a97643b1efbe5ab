"""What a card's report says, in a body's own terms: phase, stop, window and motors."""

import numpy as np

from miburi.bodies.base import Motor, Motors
from miburi.card.link import Reason, Report
from miburi.card.settings import CardSettings
from miburi.robot import JOINTS
from miburi.safety.contact import Contact, Sign, Window
from miburi.safety.profile import FINE
from miburi.safety.stop import Phase, Stop, StopReason

__all__ = ["PHASES", "UNREADY", "motors_of", "stop_of", "window_of"]

#: The card's phases, by their numbers.
PHASES = (Phase.IDLE, Phase.MOVING, Phase.STOPPED, Phase.RETURNING)
#: Why a card refuses a release, and what to do about it.
UNREADY = {
    Reason.SILENT: "servo does not answer; look at its plug, its id and the supply",
    Reason.DEAF: "servo does not take orders; switch the servos off and on",
    Reason.FAULTY: "servo reports a hardware error and was restarted; let it cool",
    Reason.HOT: "servo is too hot; let it cool",
    Reason.LOW_VOLTAGE: "supply voltage is too low; take a stronger supply or thicker wires",
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
}
_SIGNS = (Sign.SPEED, Sign.TRACKING, Sign.ARRIVAL)


def stop_of(report: Report, time: float) -> Stop | None:
    """Return the stop that holds the card since ``time`` s on the body's clock, if one does."""
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


def window_of(report: Report, settings: CardSettings) -> Window | None:
    """Return what the rule compared at the contact that holds the card: of its motor alone."""
    contact = _contact_of(report)
    if contact is None:
        return None
    judged = np.arange(len(JOINTS)) == contact.motor
    slack = settings.joints[contact.motor].guards.slack * FINE
    counted = contact.measured + (slack if contact.sign is Sign.SPEED else 0)
    measured, expected, granted, length = (
        np.where(judged, value, 0)
        for value in (contact.measured, contact.expected, counted, contact.length)
    )
    return Window(measured, expected, granted, judged, length)


def motors_of(report: Report | None, settings: CardSettings) -> Motors:
    """Return how the motors are; without a report, of a card that is lost."""
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
    # Until it has looked at a servo's health, a card reports 0 °C and 0 V.
    if not report.voltages[index]:
        return Motor(servo, answers)
    return Motor(servo, answers, report.temperatures[index], report.voltages[index] / 10)


def _contact_of(report: Report) -> Contact | None:
    """Return the contact that holds the card stopped, if one does."""
    if report.reason != Reason.CONTACT or report.motor >= len(JOINTS):
        return None
    sign = _SIGNS[report.sign - 1]
    return Contact(report.motor, sign, report.measured, report.expected, report.length)
