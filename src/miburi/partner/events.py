"""The events that a step of the partner returns. In each, ``time`` is the partner's time in s."""

from dataclasses import dataclass
from typing import Literal

from miburi.feelings import Expression
from miburi.ik import Solution
from miburi.safety.move import Move
from miburi.safety.stop import Stop


@dataclass(frozen=True)
class GestureStarted:
    """A movement function begins, with the mood as its intensity.

    Attributes
    ----------
    expression
        What it shows; None if a caller gave key poses that show no feeling.
    gesture
        The function's name; None if a caller gave the key poses.
    wish
        The name that the caller of :meth:`Partner.perform` gave the request.
    """

    time: float
    expression: Expression | None
    gesture: str | None = None
    wish: str | None = None


@dataclass(frozen=True)
class MoveSent:
    """A key pose was solved and sent to the body.

    Attributes
    ----------
    key_pose
        The key pose's number in the gesture, counted from 0.
    move, solution
        The move that was sent, and the solution that gave its angles.
    """

    time: float
    key_pose: int
    move: Move
    solution: Solution


@dataclass(frozen=True)
class GestureEnded:
    """The body is at rest after the last key pose, or something interrupted the gesture.

    Attributes
    ----------
    expression, wish
        As in :class:`GestureStarted`.
    complete
        Whether every key pose was reached.
    """

    time: float
    expression: Expression | None
    complete: bool
    wish: str | None = None


@dataclass(frozen=True)
class Stopped:
    """The body has stopped.

    Attributes
    ----------
    stop
        The stop, with its motor and reason.
    mood_before, mood_after
        The mood that is shown, in [0, 1]; they differ only for a contact.
    """

    time: float
    stop: Stop
    mood_before: float
    mood_after: float


@dataclass(frozen=True)
class Released:
    """The partner has released the body after its pause; a release that you ask for is not told.

    Attributes
    ----------
    time
        The partner's time, s.
    """

    time: float


#: Why a wish was dropped before it began.
Lapse = Literal["lapsed", "replaced", "stopped", "paused", "body"]


@dataclass(frozen=True)
class WishDropped:
    """A wish was dropped before it began.

    Attributes
    ----------
    expression, wish
        As in :class:`GestureStarted`.
    why
        The body was stopped for too long (``lapsed``), a newer wish took its place (``replaced``),
        a person pressed Stop (``stopped``), the partner was paused (``paused``), or it got another
        body (``body``).
    """

    time: float
    expression: Expression | None
    why: Lapse
    wish: str | None = None


Event = GestureStarted | MoveSent | GestureEnded | Stopped | Released | WishDropped
