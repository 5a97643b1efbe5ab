"""Performances: scripted sequences of gestures, looks and sentences.

A performance is a list of acts, each with its due time, s from the performance's start. Acts of the
body follow one another, since there is one body; sentences run alongside. One performance is on at
a time, and a few may wait.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from miburi.feelings import Expression
from miburi.gestures import KeyPose
from miburi.live.commands import BusyError

#: Performances that may wait for the present one's end (our choice).
WAITING = 10


@dataclass(frozen=True)
class Act:
    """One thing to do.

    Attributes
    ----------
    at
        When it is due, s after the performance's beginning.
    words
        What to say; None for an act of the body.
    expression, poses
        What the body shows, as :meth:`miburi.partner.Partner.perform` takes it.
    """

    at: float
    words: str | None = None
    expression: Expression | None = None
    poses: Sequence[KeyPose] | None = None


@dataclass(frozen=True)
class Play:
    """Acts in the order in which they are due, and the wish that they belong to."""

    wish: str
    acts: tuple[Act, ...]


class Stage:
    """Says which acts are due; whoever carries them out reports when one has begun or ended."""

    def __init__(self) -> None:
        #: The performance that is on.
        self.current: Play | None = None
        self._waiting: deque[Play] = deque()
        self._left: deque[Act] = deque()
        self._words: deque[Act] = deque()
        self._time = 0.0
        self._moves = self._speaks = False
        self._waits = False  # for the body, which must end what it is doing before an act begins

    def add(self, performance: Play) -> None:
        """Let a performance wait for its turn.

        Raises
        ------
        BusyError
            Too many wait.
        """
        if len(self._waiting) >= WAITING:
            raise BusyError(f"{WAITING} performances wait already; try again when one has ended.")
        self._waiting.append(performance)

    def clear(self) -> tuple[Play | None, list[Play]]:
        """End the present performance and all that wait; return them."""
        ended = self.current, [*self._waiting]
        self.current = None
        self._waiting.clear()
        return ended

    def begin(self) -> Play | None:
        """Begin the next performance if none is on; return it."""
        if self.current is not None or not self._waiting:
            return None
        self.current = self._waiting.popleft()
        acts = sorted(self.current.acts, key=lambda act: act.at)
        self._left = deque(act for act in acts if act.words is None)
        self._words = deque(act for act in acts if act.words is not None)
        self._time, self._moves, self._speaks, self._waits = 0.0, False, False, False
        return self.current

    def step(self, dt: float) -> list[Act]:
        """Let ``dt`` s pass; return the acts that are due now.

        The performance's clock stands still while the body finishes something else, so that acts
        meant to begin together do.
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
        """Record that the body has begun an act."""
        if self.current is not None and wish == self.current.wish:
            self._waits = False

    def end_act(self, wish: str | None, *, body: bool) -> None:
        """Record that an act of the body, or a sentence, has ended."""
        if self.current is not None and wish == self.current.wish:
            if body:
                self._moves = False
            else:
                self._speaks = False

    def finish(self) -> str | None:
        """If all acts have ended, end the performance and return its request's id; else None."""
        busy = self._left or self._words or self._moves or self._speaks
        if self.current is None or busy:
            return None
        wish, self.current = self.current.wish, None
        return wish
