"""The pipes and messages between the partner's process and the others.

The partner's loop has a process of its own, so that no page and no request can starve it. A
:class:`~miburi.live.crossing.far.FarPartner` in the server's process sends requests, and
:class:`~miburi.live.crossing.answering.Answering` in the runner's process replies. Two pipes
connect them, one for Stop alone::

    FarPartner ── Ask, Cancel, Look ─▶ Answering ──▶ Runner
               ◀── Answer, Latest ──────
               ═══ Stop ═════════════▶

The server requests news at every step. News is sent only on request, so that none piles up while
the server is busy. Neither side waits for the other: each sends from a separate thread.
"""

import pickle
import threading
from contextlib import suppress
from multiprocessing.connection import Connection, Pipe
from queue import SimpleQueue
from typing import Any, NamedTuple

from miburi.feelings import Temperament
from miburi.gestures import Repertoire
from miburi.live.events.event import LiveEvent
from miburi.live.state import MotorsOut, Sample
from miburi.live.wishes import Wish
from miburi.robot import Robot

#: How long slow operations, such as making a body or writing to a disk, may take, in s.
LONG = 60.0


class Lanes(NamedTuple):
    """One side's ends of the two pipes."""

    asking: Connection
    stopping: Connection

    def close(self) -> None:
        """Close both pipes."""
        self.asking.close()
        self.stopping.close()


class Hello(NamedTuple):
    """The partner's first message: the facts that never change."""

    robot: Robot
    repertoire: Repertoire
    temperaments: list[str]
    temperament: Temperament
    limit: int
    boot: str
    first: int


class Ask(NamedTuple):
    """A request; ``came`` is when it arrived, in s on the clock that all processes share."""

    number: int
    wish: Wish[Any]
    came: float


class AskRecordings(NamedTuple):
    """A call of a method of the recordings, by name; it bypasses the loop."""

    number: int
    what: str
    with_: tuple[str, ...]


class Cancel(NamedTuple):
    """Cancels a request."""

    number: int


class Answer(NamedTuple):
    """The result of a request, and the serial number of the first state that shows its effect."""

    number: int
    result: Any
    error: Exception | None
    serial: int


class Ready(NamedTuple):
    """The server is listening."""


class Look(NamedTuple):
    """A request for all news after the given event, sample and step.

    ``beats`` counts up unless the server has hung.
    """

    event: int
    sample: int
    step: int
    beats: int


class Latest(NamedTuple):
    """The latest state as JSON, and other news; ``motors`` is None if unchanged.

    ``steps`` has the earlier states that have not been sent yet, with their serial numbers.
    """

    serial: int
    state: str
    steps: list[tuple[int, str]]
    events: list[LiveEvent]
    samples: list[tuple[int, Sample]]
    motors: MotorsOut | None


def lanes() -> tuple[Lanes, Lanes]:
    """Return the partner's ends of the pipes, and the server's."""
    (asking, asked), (stopping, stopped) = Pipe(), Pipe()
    return Lanes(asked, stopped), Lanes(asking, stopping)


class Post:
    """Sends messages from a separate thread, so that the caller never waits."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._waiting: SimpleQueue[bytes] = SimpleQueue()
        threading.Thread(target=self._run, name="post", daemon=True).start()

    def send(self, message: object) -> None:
        """Send a message."""
        self._waiting.put(pickle.dumps(message))

    def _run(self) -> None:
        with suppress(OSError):  # the other side has gone
            while True:
                self._connection.send_bytes(self._waiting.get())
