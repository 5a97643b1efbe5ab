"""Live gestures: a running partner makes one, and the study sees whether it was whole.

:func:`show` goes through the client that every program uses. It asks for one gesture and looks
on; it never stops, releases or resumes a partner. :class:`Turns` gives one robot to one
participant at a time.
"""

import threading
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

from miburi.errors import BodyError, MiburiError
from miburi.feelings import Expression
from miburi.live.events.model import LiveEvent
from miburi.live.state import State, StopOut
from miburi.safety.stop import StopReason

__all__ = ["IDLE", "Ending", "Perform", "Performer", "Showing", "Turn", "Turns", "show"]

#: s for which a robot stays with a participant who does nothing (ours).
IDLE = 300.0
#: States a second to look at, and the most of them for one showing: half a minute (ours).
_RATE, _LOOKS = 20, 600


class Ending(StrEnum):
    """What became of a gesture."""

    #: It was made from its first key pose to its last.
    WHOLE = "whole"
    #: It was stopped, and goes on by itself: it was touched.
    TOUCHED = "touched"
    #: It was stopped, and waits for a person.
    STOPPED = "stopped"
    #: Somebody lets the partner rest.
    PAUSED = "paused"
    #: The partner cannot be reached, or refuses.
    ABSENT = "absent"
    #: Something else came between: another wish, another body, no time for it in half a minute.
    BROKEN = "broken"


@dataclass(frozen=True)
class Showing:
    """What became of a gesture, and whether it began: then somebody saw a part of it at least."""

    ending: Ending
    begun: bool


Perform = Callable[[Expression], Showing]


class Performer(Protocol):
    """A partner as :func:`show` needs it; :func:`miburi.connect` returns one."""

    def watch(self, rate: float = 30.0, patience: float = 0.0) -> Generator[State, None, None]:
        """Yield states."""

    def express(self, expression: Expression) -> object:
        """Perform a gesture once."""

    def log(self, after: str | None = None) -> list[LiveEvent]:
        """Return the events after one, by its id."""


def show(
    robot: Performer, expression: Expression, is_over: Callable[[], bool] = lambda: False
) -> Showing:
    """Let the robot make a gesture, and wait until it has, or until it is clear that it has not.

    A gesture of its own comes to its end before. Nothing is asked of a robot that is stopped or
    paused: it would make the gesture later, when nobody looks. Once ``is_over`` says so, nobody
    waits any more.
    """
    view = _View(expression, is_over)
    try:
        with closing(robot.watch(_RATE, 0.0)) as states:
            ending = view.follow(robot, states)
    except BodyError:  # it was paused in between
        ending = Ending.PAUSED
    except MiburiError:
        ending = Ending.ABSENT
    return Showing(ending, view.begun)


class _View:
    """Follows the states of a partner while it makes one gesture."""

    def __init__(self, expression: Expression, is_over: Callable[[], bool]) -> None:
        self._wanted = (expression.feeling, expression.mood)
        self._expression, self._is_over = expression, is_over
        self.begun = False

    def follow(self, robot: Performer, states: Iterator[State]) -> Ending:
        """Ask for the gesture as soon as the robot is free, and say what becomes of it."""
        latest = None
        for looks, state in enumerate(states):
            if looks == _LOOKS or self._is_over():
                return Ending.BROKEN
            if (hindered := _hindrance(state)) is not None:
                return hindered
            if latest is None:
                # A Stop is answered a step before states show it, so the first one may be too old.
                if looks and state.expressed is None and state.phase != "returning":
                    latest = state.cursor
                    robot.express(self._expression)
            elif self._is_shown(state):
                self.begun = True
            elif self.begun:
                return _judge(robot.log(latest))
        return Ending.ABSENT

    def _is_shown(self, state: State) -> bool:
        shown = state.expressed
        return state.asked and shown is not None and (shown.feeling, shown.mood) == self._wanted


def _hindrance(state: State) -> Ending | None:
    """Return why a partner makes no gesture now; None if it may."""
    if state.phase == "stopped":
        return Ending.STOPPED if state.held else _stopped(state.stop)
    return Ending.PAUSED if state.paused else None


def _stopped(stop: StopOut | None) -> Ending:
    """Tell stops that end by themselves from those that a person ends."""
    match stop.reason if stop is not None else None:
        case StopReason.CONTACT | StopReason.TOUCHED:
            return Ending.TOUCHED
        case StopReason.LOOP_LATE:
            return Ending.BROKEN
        case _:
            return Ending.STOPPED


def _judge(entries: list[LiveEvent]) -> Ending:
    """Say what became of a gesture from the log since then; no state in between is missed so."""
    for entry in entries:
        match entry.kind:
            case "stop":
                return _stopped(entry.stop)
            case "paused":
                return Ending.PAUSED
            case "body" | "loop_failed":
                return Ending.BROKEN
    return Ending.WHOLE


class Turn(StrEnum):
    """Whether a participant may see a gesture now."""

    YOURS = "yours"
    #: The robot is making this participant's gesture already.
    MOVING = "moving"
    #: It is with another participant.
    TAKEN = "taken"


class Turns:
    """Who is with the robot: one participant at a time, until they finish or do nothing for long.

    Parameters
    ----------
    clock
        Gives s.
    idle
        After so many s without a page another participant may begin.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic, idle: float = IDLE) -> None:
        self._clock, self._idle = clock, idle
        self._lock = threading.Lock()
        self._number: int | None = None
        self._until = 0.0
        self._moving = False

    def look(self, number: int) -> Turn:
        """Return whether a participant may press the button; whoever has the robot keeps it."""
        with self._lock:
            turn = self._turn(number)
            if self._number == number:
                self._until = self._clock() + self._idle
            return turn

    def begin(self, number: int) -> Turn:
        """Give the robot to a participant for a gesture, if it is free; :meth:`end` ends that."""
        with self._lock:
            turn = self._turn(number)
            if turn is Turn.YOURS:
                self._number, self._moving = number, True
            return turn

    def end(self, number: int) -> None:
        """Say that the gesture is over; the robot stays with the participant."""
        with self._lock:
            if self._number == number:
                self._moving, self._until = False, self._clock() + self._idle

    def leave(self, number: int) -> None:
        """Take a participant from the robot: the next one may begin."""
        with self._lock:
            if self._number == number and not self._moving:
                self._number = None

    def _turn(self, number: int) -> Turn:
        if self._number == number:
            return Turn.MOVING if self._moving else Turn.YOURS
        free = self._number is None or (not self._moving and self._clock() >= self._until)
        return Turn.YOURS if free else Turn.TAKEN
