"""The partner: a loop that lets feelings move a body, one deterministic ``step`` at a time."""

from miburi.partner.events import (
    Event,
    GestureEnded,
    GestureStarted,
    Lapse,
    MoveSent,
    Released,
    Stopped,
    WishDropped,
)
from miburi.partner.loop import LAPSES, Partner
from miburi.partner.mover import Solve, solve_with
from miburi.partner.recovery import UnsettledError

__all__ = [
    "LAPSES",
    "Event",
    "GestureEnded",
    "GestureStarted",
    "Lapse",
    "MoveSent",
    "Partner",
    "Released",
    "Solve",
    "Stopped",
    "UnsettledError",
    "WishDropped",
    "solve_with",
]
