"""Differences between servos, as shares of the description's constants."""

from dataclasses import dataclass

from miburi.robot import Array


@dataclass(frozen=True)
class Shares:
    """Eight servos, as shares of the description's constants, (8,) each.

    Attributes
    ----------
    stiffness, damping, friction
        Shares of the control's stiffness, of back EMF with viscous friction, and of dry friction.
    gravity
        Shares of the load's weight; 1 where the joint carries none.
    wear
        The friction of all servos as a multiple of the description's, 1 or more; ``friction`` is a
        share of this friction. The torque that a move needs is computed with this wear.
    """

    stiffness: Array
    damping: Array
    friction: Array
    gravity: Array
    wear: float = 1.0
