"""Bodies: what the partner moves, all behind one interface."""

from miburi.bodies.base import Body, BodyState, Phase, Stop

__all__ = ["Body", "BodyState", "Phase", "Stop"]
