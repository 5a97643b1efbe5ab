"""The simulated human hand, which moves to a requested position at a human hand's speed."""

from collections import deque

import numpy as np

from miburi.bodies import Touchable
from miburi.errors import BodyError, InputError
from miburi.robot import Array

#: The hand's greatest speed, m/s (our choice), so that it cannot jump into the robot.
FASTEST = 1.2
#: The hand's speed in m/s while it touches the robot, and the time in s for which it stays slow
#: afterwards (our choice). A faster hand, caught between an arm and the trunk, would be deep
#: in the arm before the arm yields.
FEELING, WARY = 0.3, 0.5
#: A hand that meets more than this force, in N, backs off at its greatest speed (our choice). The
#: servos press with less force than this; a bruise needs far more.
GIVES_WAY = 40.0
#: How many steps of its path the hand remembers, so that it can back off along them (our choice).
REMEMBERED = 200


class GuidedHand:
    """Moves the hand towards its goal, step by step.

    Attributes
    ----------
    goal
        The hand's destination, shape (3,), in m; None while nobody guides it.
    """

    def __init__(self) -> None:
        self.goal: Array | None = None
        self._along = np.array([0.0, 0.0, 1.0])
        self._came: deque[Array] = deque(maxlen=REMEMBERED)
        self._wary = 0.0

    def guide(self, body: Touchable | None, position: Array | None, along: Array) -> None:
        """Let the hand go to a position, or remove it.

        ``position`` has shape (3,), in m; None removes the hand. The fingers point ``along`` (3,).

        Raises BodyError if the present body cannot be touched; InputError if the direction has no
        length.
        """
        if body is None:
            raise BodyError("only a simulated body has a hand to move.")
        if float(np.linalg.norm(along)) < 1e-6:
            raise InputError("'along' must not be the zero vector.")
        self._along = along
        if position is None:
            body.remove_hand()
        self.goal = position

    def step(self, body: Touchable | None, dt: float) -> None:
        """Advance by ``dt`` s; the hand does not move if the body cannot be touched."""
        if self.goal is None or body is None:
            return
        here = body.configuration[1][:3].copy()
        force = body.touch.force
        self._wary = WARY if force > 0 else self._wary - dt
        if force > GIVES_WAY:
            # The path by which the hand came was free. The path directly away from the goal leads
            # into the robot if the goal lies further out.
            place = self._back(here, FASTEST * dt)
        else:
            if not (self._came and np.array_equal(here, self._came[-1])):
                self._came.append(here)
            place = _towards(here, self.goal, (FEELING if self._wary > 0 else FASTEST) * dt)
        body.place_hand(place, self._along)

    def _back(self, here: Array, distance: float) -> Array:
        """Return the place that lies ``distance`` m back along the hand's path."""
        while self._came and distance > 0:
            before = self._came[-1]
            length = float(np.linalg.norm(before - here))
            here = _towards(here, before, distance)
            if length <= distance:
                self._came.pop()
            distance -= length
        return here


def _towards(here: Array, there: Array, distance: float) -> Array:
    way = there - here
    length = float(np.linalg.norm(way))
    return there if length <= distance else here + way * (distance / length)
