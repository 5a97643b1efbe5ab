"""The partner: feelings, a body, and what happens between them, in one deterministic ``step``."""

from miburi.partner.loop import (
    Event,
    GestureEnded,
    GestureStarted,
    MoveSent,
    Partner,
    Released,
    Solve,
    Stopped,
)

__all__ = [
    "Event",
    "GestureEnded",
    "GestureStarted",
    "MoveSent",
    "Partner",
    "Released",
    "Solve",
    "Stopped",
]
