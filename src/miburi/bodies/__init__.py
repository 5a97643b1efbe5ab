"""Bodies: the interface of everything that the partner can move, and the simulated body."""

from miburi.bodies.base import Body, BodyState, Motor, Motors, Touch, Touchable

__all__ = [
    "Body",
    "BodyState",
    "Motor",
    "Motors",
    "Touch",
    "Touchable",
]
