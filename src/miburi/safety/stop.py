"""The phases of a body, and the record of a stop: why, which motor, and the rule's figures."""

from dataclasses import dataclass
from enum import StrEnum


class Phase(StrEnum):
    """What a body is doing: idle → moving → idle, or stopped (latched) → returning → idle."""

    IDLE = "idle"
    MOVING = "moving"
    STOPPED = "stopped"
    RETURNING = "returning"


class StopReason(StrEnum):
    """The reason for a stop; pages show it in their language."""

    CONTACT = "contact"
    TOUCHED = "touched"
    ASKED = "asked"
    CARD_STARTED = "card_started"
    LINE_LOST = "line_lost"
    SERVO_SILENT = "servo_silent"
    SERVO_DEAF = "servo_deaf"
    SERVO_FAULTY = "servo_faulty"
    SERVO_HOT = "servo_hot"
    LOW_VOLTAGE = "low_voltage"
    SERVO_ASTRAY = "servo_astray"
    SERVO_MISNAMED = "servo_misnamed"
    SERVO_RESTARTED = "servo_restarted"
    LOOP_LATE = "loop_late"

    @property
    def passes(self) -> bool:
        """Whether the partner releases such a stop by itself once nobody holds the body."""
        return self in (StopReason.CONTACT, StopReason.TOUCHED, StopReason.LOOP_LATE)

    @property
    def spoken(self) -> str:
        """The reason in plain words, for error messages."""
        return self.replace("_", " ")


@dataclass(frozen=True)
class Stop:
    """A latched stop; it ends only by :meth:`Body.release`.

    Attributes
    ----------
    time
        When it happened, in s on the body's clock.
    reason
        A contact, a request, or a failure.
    motor
        Full name of the motor that met something or was moved; None where no single motor was.
    sign
        For a contact, the test that found it: ``speed``, ``tracking`` or ``arrival``.
    ratio
        For a contact, the measured travel divided by the expected travel.
    """

    time: float
    reason: StopReason
    motor: str | None = None
    sign: str | None = None
    ratio: float | None = None
