"""The simulated human hand of a live partner: it goes where it is asked to, as fast as a person."""

import numpy as np

from miburi.bodies import Touchable
from miburi.errors import BodyError, InputError
from miburi.robot import Array

__all__ = ["FASTEST", "FEELING", "GIVES_WAY", "GuidedHand"]

#: The hand's greatest speed, m/s (ours): it cannot jump into the robot.
FASTEST = 1.2
#: Its speed while it feels the robot, m/s (ours): faster, it would be deep inside an arm that is
#: caught between it and the trunk before the arm could give way.
FEELING = 0.3
#: A hand that meets this force goes back as fast as it came, N (ours). It is more than the servos
#: press with, and far less than what bruises.
GIVES_WAY = 40.0


class GuidedHand:
    """Moves the hand towards its goal, step by step.

    Attributes
    ----------
    goal
        Where the hand goes, (3,) m; None while nobody guides it.
    """

    def __init__(self) -> None:
        self.goal: Array | None = None
        self._along = np.array([0.0, 0.0, 1.0])

    def guide(self, body: Touchable | None, position: Array | None, along: Array) -> None:
        """Let the hand go to ``position`` (3,) m, fingers ``along`` (3,); None takes it away.

        Raises
        ------
        BodyError
            The body is None: there is none that can be touched.
        InputError
            The direction has no length.
        """
        if body is None:
            raise BodyError("only a simulated body has a hand to move.")
        if float(np.linalg.norm(along)) < 1e-6:
            raise InputError("along must have a length.")
        self._along = along
        if position is None:
            body.remove_hand()
        self.goal = position

    def step(self, body: Touchable | None, dt: float) -> None:
        """Let ``dt`` seconds pass; a body that nobody can touch leaves the hand where it is."""
        if self.goal is None or body is None:
            return
        here = body.configuration[1][:3]
        way = self.goal - here
        length = float(np.linalg.norm(way))
        force = body.touch.force
        speed = FEELING if 0 < force <= GIVES_WAY else FASTEST
        reach = min(1.0, speed * dt / length) if length > 0 else 1.0
        if force > GIVES_WAY:
            reach = -reach
        body.place_hand(here + reach * way, self._along)
