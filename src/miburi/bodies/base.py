"""What every body takes and tells, whatever moves it: physics, or motors on a card."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

from miburi.motion import Move
from miburi.robot import Array, Robot


class Phase(StrEnum):
    """Where a body is in idle → moving → stopped (latched) → returning → idle."""

    IDLE = "idle"
    MOVING = "moving"
    STOPPED = "stopped"
    RETURNING = "returning"


class StopReason(StrEnum):
    """Why a body stopped; pages say it in the words of their language."""

    CONTACT = "contact"
    ASKED = "asked"
    CARD_STARTED = "card_started"
    LINE_LOST = "line_lost"
    SERVO_SILENT = "servo_silent"
    SERVO_DEAF = "servo_deaf"
    SERVO_FAULTY = "servo_faulty"
    SERVO_HOT = "servo_hot"
    LOW_VOLTAGE = "low_voltage"

    @property
    def spoken(self) -> str:
        """The reason in plain letters, for error messages."""
        return self.replace("_", " ")


@dataclass(frozen=True)
class Stop:
    """A latched stop; it ends only by :meth:`Body.release`.

    Attributes
    ----------
    time
        s, on the body's clock.
    reason
        A contact, somebody who asked, or what failed.
    motor
        Full name of the motor that met something; None where no single motor did.
    sign
        For a contact, what gave it away: ``speed``, ``tracking`` or ``arrival``.
    ratio
        For a contact, measured over expected travel.
    """

    time: float
    reason: StopReason
    motor: str | None = None
    sign: str | None = None
    ratio: float | None = None


@dataclass(frozen=True)
class BodyState:
    """What the motors say.

    Attributes
    ----------
    time
        s, on the body's clock.
    angles, velocities
        (8,) rad and rad/s, as the encoders measure them.
    phase
        Idle, moving, stopped or returning.
    stop
        The stop that holds now, or None.
    """

    time: float
    angles: Array
    velocities: Array
    phase: Phase
    stop: Stop | None


class Body(Protocol):
    """The one interface that the partner moves.

    The contact rule is part of the body and cannot be switched off through it.
    """

    @property
    def robot(self) -> Robot:
        """The description that the body was built from."""

    @property
    def state(self) -> BodyState:
        """The latest state; a body at rest is idle."""

    def move(self, move: Move) -> None:
        """Start a move to final positions; only an idle body takes one.

        Raises
        ------
        BodyError
            The body is not idle, or the move leaves the limits.
        """

    def stop(self) -> None:
        """Stop all motors and hold softly until released."""

    def release(self) -> None:
        """End a stop: go back to neutral, slowly; the contact rule stays on.

        Raises
        ------
        BodyError
            The body is not stopped.
        """

    def step(self, dt: float) -> BodyState:
        """Let ``dt`` seconds pass and return the state after them."""
