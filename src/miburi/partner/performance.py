"""One performance: the key poses of a gesture, in their order, each with its hold.

A gesture's key poses are asked for anew at every move, at the mood of that moment; key poses that
somebody asked for, and a breath's, are what they are. The partner asks when it is time for the
next key pose, and which it is.
"""

from collections.abc import Callable, Iterator, Sequence

from miburi import gestures
from miburi.feelings import Expression
from miburi.gestures import KeyPose, MovementFunction
from miburi.robot import Robot

__all__ = ["Performance"]


class Performance:
    """What is being performed, and how far it has come.

    Parameters
    ----------
    poses
        The key poses at a mood from 0 to 1; their number does not depend on it.
    expression
        What is shown; None for a breath.
    gesture
        The gesture's name; None where the key poses are no gesture's.
    asked
        Whether somebody asked for it.
    """

    def __init__(
        self,
        poses: Callable[[float], Sequence[KeyPose]],
        expression: Expression | None = None,
        gesture: str | None = None,
        *,
        asked: bool = False,
    ) -> None:
        self.expression = expression
        self.gesture = gesture
        self.asked = asked
        self._poses = poses
        self._next, self._count = 0, -1
        self._hold = 0.0
        self._hold_until: float | None = None

    @classmethod
    def of_gesture(
        cls,
        robot: Robot,
        function: MovementFunction,
        expression: Expression,
        variation: int | None,
    ) -> "Performance":
        """Perform a gesture at the mood of each moment; see :func:`miburi.gestures.key_poses`."""

        def poses(mood: float) -> list[KeyPose]:
            return gestures.key_poses(robot, function, mood, variation=variation)

        return cls(poses, expression, function.name)

    @classmethod
    def of_breath(cls, robot: Robot, variation: int | None) -> "Performance":
        """Perform one breath."""
        return cls(lambda _mood: gestures.breath(robot, variation=variation))

    def is_due(self, time: float) -> bool:
        """Whether a body that rests at ``time`` s has held its key pose for long enough."""
        if self._hold_until is None:
            self._hold_until = time + self._hold
        return time >= self._hold_until - 1e-9

    def go_on(self, mood: float) -> Iterator[tuple[int, KeyPose]]:
        """Yield the key poses that are left, each with its number, as they are at a mood."""
        poses = self._poses(mood)
        self._count = len(poses)
        for index in range(self._next, len(poses)):
            self._next = index + 1
            yield index, poses[index]

    @property
    def complete(self) -> bool:
        """Whether the last key pose has been taken."""
        return self._next == self._count

    def hold(self, seconds: float) -> None:
        """Hold the key pose that is on its way for so long, from when the body rests there."""
        self._hold, self._hold_until = seconds, None
