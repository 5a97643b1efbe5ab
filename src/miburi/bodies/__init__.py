"""Bodies: the interface through which the robot partner moves any body, and the simulated body."""

from miburi.bodies.base import Body, BodyState, Motor, Motors, Touch, Touchable

__all__ = [
    "Body",
    "BodyState",
    "Motor",
    "Motors",
    "Touch",
    "Touchable",
]
