"""One performance: the key poses of a gesture in order, each with the time for which it is held.

A :class:`Performance` takes a function from a mood to key poses. It knows whether the next key pose
is due, and which one it is. A gesture's key poses are recomputed for every move, at the mood of
that moment; those of a request or of an act at rest stay the same.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from miburi.feelings import Expression
from miburi.gestures import KeyPose


@dataclass
class Performance:
    """A sequence of key poses, and how far the body has come in it.

    Attributes
    ----------
    poses
        Returns the key poses at a mood from 0 to 1, always the same number of them.
    expression
        What it shows; None for an act at rest.
    gesture
        The gesture's name; None if the key poses belong to no gesture.
    asked
        Whether somebody asked for it.
    rests
        The name of the act if this is an act at rest; otherwise empty. Any other performance
        interrupts an act at rest.
    wish
        The name that the caller gave the request.
    turn
        The angle, in rad, by which all key poses are turned to the robot's left, towards somebody.
    """

    poses: Callable[[float], Sequence[KeyPose]]
    expression: Expression | None = None
    gesture: str | None = None
    asked: bool = False
    rests: str = ""
    wish: str | None = None
    turn: float = 0.0

    def __post_init__(self) -> None:
        self._next, self._count = 0, -1
        self._hold = 0.0
        self._hold_until: float | None = None
        self._passes_at: float | None = None

    def is_due(self, time: float) -> bool:
        """Whether a body at rest at ``time`` s has held its key pose long enough."""
        if self._hold_until is None:
            self._hold_until = time + self._hold
        return time >= self._hold_until - 1e-9

    def go_on(self, mood: float) -> Iterator[tuple[int, KeyPose]]:
        """Yield the key poses that are still to come at this mood, each with its number."""
        poses = self.poses(mood)
        self._count = len(poses)
        for index in range(self._next, len(poses)):
            self._next = index + 1
            yield index, poses[index]

    @property
    def tells(self) -> bool:
        """Whether the beginning and the end cause events; those of beats and idle acts do not."""
        return self.expression is not None or self.wish is not None

    @property
    def complete(self) -> bool:
        """Whether no key pose is left."""
        return self._next == self._count

    def passes(self, time: float) -> bool:
        """Whether a body that moves at ``time`` s is to go on to the next key pose."""
        return self._passes_at is not None and time >= self._passes_at and not self.complete

    def not_sent(self, index: int) -> None:
        """Keep a key pose that the body did not accept, until the body is at rest."""
        self._next, self._passes_at = index, None

    def sent(self, pose: KeyPose, slows_at: float | None) -> None:
        """Note the key pose that was just sent; the body will hold it or pass through it.

        ``slows_at`` is when the body slows down for this pose, in s; None if the body stops at
        every pose.
        """
        self._hold, self._hold_until = pose.hold, None
        self._passes_at = slows_at if pose.passes else None
