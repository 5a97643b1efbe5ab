"""Bodies: the interface that the robot partner moves any body by, and the simulated body."""

from miburi.bodies.base import Body, BodyState, Motor, Motors, Touch, Touchable

__all__ = [
    "Body",
    "BodyState",
    "Motor",
    "Motors",
    "Touch",
    "Touchable",
]
