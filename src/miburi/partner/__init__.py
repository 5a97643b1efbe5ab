"""The partner: a loop that lets feelings move a body, one deterministic ``step`` at a time."""

from miburi.partner.loop import (
    Event,
    GestureEnded,
    GestureStarted,
    MoveSent,
    Partner,
    Released,
    Solve,
    Stopped,
    solve_with,
)
from miburi.partner.recovery import UnsettledError

__all__ = [
    "Event",
    "GestureEnded",
    "GestureStarted",
    "MoveSent",
    "Partner",
    "Released",
    "Solve",
    "Stopped",
    "UnsettledError",
    "solve_with",
]
