"""Performances: scripted sequences of gestures, looks and sentences.

A performance is a list of acts with due times. Acts of the body follow one another; sentences run
alongside. One performance runs at a time, and a few may wait.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from miburi.feelings import Expression
from miburi.gestures import KeyPose
from miburi.live.commands import BusyError
from miburi.partner import LAPSES
from miburi.serving.press import By

#: How many performances may wait (our choice).
WAITING = 10


@dataclass(frozen=True)
class Act:
    """A gesture, a look or a sentence of a performance.

    Attributes
    ----------
    at
        When the act is due, in s from the performance's start.
    words
        The sentence; None for an act of the body.
    expression, poses
        What the body shows, as :meth:`miburi.partner.Partner.perform` takes it.
    """

    at: float
    words: str | None = None
    expression: Expression | None = None
    poses: Sequence[KeyPose] | None = None


@dataclass
class Play:
    """The acts of a performance, the id of the wish for it, and who asked."""

    wish: str
    acts: tuple[Act, ...]
    by: By = "person"
    waited: float = 0.0  # how long it has waited for a stopped body, s


class Stage:
    """Tells which acts are due; the caller reports their beginnings and ends."""

    def __init__(self) -> None:
        #: The performance that is running, if any.
        self.current: Play | None = None
        self._waiting: deque[Play] = deque()
        self._left: deque[Act] = deque()
        self._words: deque[Act] = deque()
        self._time = 0.0
        self._moves = self._speaks = False
        self._waits = False  # for the body to begin an act

    def add(self, performance: Play) -> None:
        """Queue a performance.

        Raises BusyError if too many performances are waiting.
        """
        if len(self._waiting) >= WAITING:
            raise BusyError(f"{WAITING} performances wait already; try again when one has ended.")
        self._waiting.append(performance)

    def clear(self) -> tuple[Play | None, list[Play]]:
        """Drop the present performance and the waiting ones; return them."""
        ended = self.current, [*self._waiting]
        self.current = None
        self._waiting.clear()
        return ended

    def wait(self, dt: float, *, stopped: bool) -> list[Play]:
        """Let ``dt`` s pass; drop and return what has waited too long for a stopped body."""
        for play in self._waiting:
            play.waited = play.waited + dt if stopped else 0.0
        lapsed = [play for play in self._waiting if play.waited > LAPSES]
        self._waiting = deque(play for play in self._waiting if play not in lapsed)
        return lapsed

    def begin(self) -> Play | None:
        """Begin the next performance unless one is running; return it."""
        if self.current is not None or not self._waiting:
            return None
        self.current = self._waiting.popleft()
        acts = sorted(self.current.acts, key=lambda act: act.at)
        self._left = deque(act for act in acts if act.words is None)
        self._words = deque(act for act in acts if act.words is not None)
        self._time, self._moves, self._speaks, self._waits = 0.0, False, False, False
        return self.current

    def step(self, dt: float) -> list[Act]:
        """Advance by ``dt`` s; return the acts that are due now.

        The performance's clock stands still until the body begins its act, so that acts with the
        same due time begin together.
        """
        due: list[Act] = []
        if self.current is None or self._waits:
            return due
        if self._left and not self._moves and self._left[0].at <= self._time:
            self._moves = self._waits = True
            return [self._left.popleft()]
        if self._words and not self._speaks and self._words[0].at <= self._time:
            due.append(self._words.popleft())
            self._speaks = True
        self._time += dt
        return due

    def begin_act(self, wish: str | None) -> None:
        """Note that the body has begun an act."""
        if self.current is not None and wish == self.current.wish:
            self._waits = False

    def end_act(self, wish: str | None, *, body: bool) -> None:
        """Note the end of an act of the body, or of a sentence."""
        if self.current is not None and wish == self.current.wish:
            if body:
                self._moves = False
            else:
                self._speaks = False

    def finish(self) -> str | None:
        """End the performance if all its acts have ended; return the id of its wish, or None."""
        busy = self._left or self._words or self._moves or self._speaks
        if self.current is None or busy:
            return None
        wish, self.current = self.current.wish, None
        return wish
