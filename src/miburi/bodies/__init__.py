"""Bodies: what the partner moves, all behind one interface."""

from miburi.bodies.base import Body, BodyState, Phase, Stop, StopReason

__all__ = ["Body", "BodyState", "Phase", "Stop", "StopReason"]
