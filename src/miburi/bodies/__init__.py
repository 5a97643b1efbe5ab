"""Bodies: what the partner moves, all behind one interface."""

from miburi.bodies.base import Body, BodyState, Motor, Motors, Touch, Touchable

__all__ = [
    "Body",
    "BodyState",
    "Motor",
    "Motors",
    "Touch",
    "Touchable",
]
