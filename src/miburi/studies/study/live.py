"""Live gestures: a running partner makes a gesture, and the study checks that it was complete.

:func:`show` uses the same client as any other program. It requests one gesture and only watches; it
never stops, releases or resumes a partner. :class:`Turns` gives one robot to one participant at a
time.
"""

import threading
from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Protocol

from miburi.client.remote import RemotePartner
from miburi.errors import BodyError, MiburiError
from miburi.feelings import Expression
from miburi.live.events.event import LiveEvent
from miburi.live.state import State, StopOut
from miburi.safety.stop import StopReason

#: How long, in s, a robot stays with an idle participant (our choice).
IDLE = 300.0
#: How many states are read per second, and the largest number of states for one showing: half a
#: minute of them (our choice).
_RATE, _LOOKS = 20, 600


class Ending(StrEnum):
    """The outcome of a gesture."""

    WHOLE = "whole"  #: made from its first key pose to its last
    TOUCHED = "touched"  #: the partner was touched and stopped; it resumes by itself
    STOPPED = "stopped"  #: it was stopped, and waits for a person
    PAUSED = "paused"  #: somebody has paused the partner
    ABSENT = "absent"  #: the partner cannot be reached, or refuses
    #: Another request, another body, a late loop, or no opportunity for half a minute.
    BROKEN = "broken"


@dataclass(frozen=True)
class Showing:
    """The outcome of a gesture, and whether it began, so that part of it was seen.

    ``others`` returns how many other gestures the robot has begun since; 0 if that is not known.
    """

    ending: Ending
    begun: bool
    others: Callable[[], int] = field(default=lambda: 0, compare=False)


Perform = Callable[[Expression], Showing]


class Performer(Protocol):
    """The methods that :func:`show` needs; partners from :func:`miburi.connect` have them."""

    def watch(self, rate: float = 30.0, patience: float = 0.0) -> Generator[State, None, None]:
        """Yield states."""

    def express(self, expression: Expression) -> object:
        """Perform a gesture once."""

    def log(self, after: str | None = None) -> list[LiveEvent]:
        """Return the events after the one with this id."""


def show(
    robot: Performer, expression: Expression, is_over: Callable[[], bool] = lambda: False
) -> Showing:
    """Have the robot make a gesture, wait for its end or failure, and return the outcome.

    If the robot is making a gesture already, it finishes that one first. Nothing is requested from
    a robot that is stopped or paused: it would make the gesture later, when nobody is watching.
    Once ``is_over`` returns true, ``show`` stops waiting.
    """
    view = _View(expression, is_over)
    try:
        with closing(robot.watch(_RATE, 0.0)) as states:
            ending = view.follow(robot, states)
    except BodyError:  # it was paused in between
        ending = Ending.PAUSED
    except MiburiError:
        ending = Ending.ABSENT
    return Showing(ending, view.begun, lambda: view.others(robot))


def facts_of(partner: RemotePartner) -> dict[str, object]:
    """Return what a partner tells of itself, for the findings; it does not tell its seed."""
    robot, state = partner.robot, partner.state
    return {
        "robot": robot.name,
        "miburi": robot.version,
        "body": state.body,
        "rule": state.rule.model_dump(),
        "temperament": state.temperament,
        "rest": state.rest,
        "gestures": [gesture.model_dump(mode="json") for gesture in partner.gestures()],
    }


class _View:
    """Follows the states of a partner while it makes one gesture."""

    def __init__(self, expression: Expression, is_over: Callable[[], bool]) -> None:
        self._wanted = (expression.feeling, expression.mood)
        self._expression, self._is_over = expression, is_over
        self.begun = False
        self._latest: str | None = None  # the event before the gesture

    def follow(self, robot: Performer, states: Iterator[State]) -> Ending:
        """Request the gesture as soon as the robot is free; return the outcome."""
        for looks, state in enumerate(states):
            if looks == _LOOKS or self._is_over():
                return Ending.BROKEN
            if (hindered := _hindrance(state)) is not None:
                return hindered
            if self._latest is None:
                # The first state may be out of date: a Stop is acknowledged a step before states
                # show it.
                if looks and state.expressed is None and state.phase != "returning":
                    self._latest = state.cursor
                    robot.express(self._expression)
            elif self._is_shown(state):
                self.begun = True
            elif self.begun:
                return _judge(robot.log(self._latest))
        return Ending.ABSENT

    def others(self, robot: Performer) -> int:
        """Return how many gestures the robot has begun after the wanted one."""
        try:
            entries = robot.log(self._latest)
        except MiburiError:
            return 0
        shown = [(entry.feeling, entry.mood) for entry in entries if entry.kind == "gesture_begun"]
        return len(shown) - shown.index(self._wanted) - 1 if self._wanted in shown else 0

    def _is_shown(self, state: State) -> bool:
        shown = state.expressed
        return state.asked and shown is not None and (shown.feeling, shown.mood) == self._wanted


def _hindrance(state: State) -> Ending | None:
    """Return the outcome for a partner that cannot make a gesture now; None if it can."""
    if state.phase == "stopped":
        return Ending.STOPPED if state.held else _stopped(state.stop)
    return Ending.PAUSED if state.paused else None


def _stopped(stop: StopOut | None) -> Ending:
    match stop.reason if stop is not None else None:
        case StopReason.CONTACT | StopReason.TOUCHED:
            return Ending.TOUCHED
        case StopReason.LOOP_LATE:
            return Ending.BROKEN
        case _:
            return Ending.STOPPED


def _judge(entries: list[LiveEvent]) -> Ending:
    """Return the outcome from the log, which is complete; states may have been missed."""
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
    MOVING = "moving"  #: the robot is making this participant's gesture already
    TAKEN = "taken"  #: it is with another participant


class Turns:
    """Reserves the robot for one participant at a time, until they finish or are idle too long.

    ``clock`` returns the time in s.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._number: int | None = None
        self._until = 0.0
        self._moving = False

    def look(self, number: int) -> Turn:
        """Return whether a participant may press the button; whoever has the robot keeps it."""
        with self._lock:
            turn = self._turn(number)
            if self._number == number:
                self._until = self._clock() + IDLE
            return turn

    def begin(self, number: int) -> Turn:
        """Reserve the robot for a gesture, if it is free; call :meth:`end` after the gesture."""
        with self._lock:
            turn = self._turn(number)
            if turn is Turn.YOURS:
                self._number, self._moving = number, True
            return turn

    def end(self, number: int) -> None:
        """Note that the gesture is over; the participant keeps the robot."""
        with self._lock:
            if self._number == number:
                self._moving, self._until = False, self._clock() + IDLE

    def leave(self, number: int) -> None:
        """Free the robot for the next participant."""
        with self._lock:
            if self._number == number and not self._moving:
                self._number = None

    def _turn(self, number: int) -> Turn:
        if self._number == number:
            return Turn.MOVING if self._moving else Turn.YOURS
        free = self._number is None or (not self._moving and self._clock() >= self._until)
        return Turn.YOURS if free else Turn.TAKEN
