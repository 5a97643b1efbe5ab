"""The crossing between the partner's process and the others: its pipes and its messages.

The partner's loop has a process of its own, so that no page and no request can starve it. The
server's process holds a :class:`~miburi.live.crossing.far.FarPartner`, which sends requests; in the
runner's process, :class:`~miburi.live.crossing.answering.Answering` replies to them. Two pipes
lie between them, one for Stop alone::

    FarPartner ── Ask, Cancel, Look ─▶ Answering ──▶ Runner
               ◀── Answer, Latest ──────
               ═══ Stop ═════════════▶

The server asks for news at every step, and news is sent only on request, so that none piles up
while it is busy. Neither side waits for the other: each sends from a thread of its own.
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

#: How long to wait for slow operations, such as making a body or writing to a disk, s.
LONG = 60.0


class Lanes(NamedTuple):
    """One side's ends of the two pipes."""

    asking: Connection
    stopping: Connection

    def close(self) -> None:
        """Close both."""
        self.asking.close()
        self.stopping.close()


class Hello(NamedTuple):
    """The partner's first message: everything that does not change later."""

    robot: Robot
    repertoire: Repertoire
    temperaments: list[str]
    temperament: Temperament
    limit: int
    boot: str
    first: int


class Ask(NamedTuple):
    """A request; ``came`` is its time of arrival in s, on the clock that all processes share."""

    number: int
    wish: Wish[Any]
    came: float


class AskRecordings(NamedTuple):
    """A call of a method of the recordings, by name; it does not pass through the loop."""

    number: int
    what: str
    with_: tuple[str, ...]


class Cancel(NamedTuple):
    """Cancels a request whose answer nobody awaits any more."""

    number: int


class Answer(NamedTuple):
    """The result of a request, and the serial number of the first state that shows its effect."""

    number: int
    result: Any
    error: Exception | None
    serial: int


class Ready(NamedTuple):
    """The server is up."""


class Look(NamedTuple):
    """Ask for news: everything after the numbers given here is new.

    ``beats`` counts up while the server is alive; if it stops rising, the server has hung.
    """

    event: int
    sample: int
    step: int
    beats: int


class Latest(NamedTuple):
    """The latest state as JSON, and other news; ``motors`` is None if it has not changed.

    ``steps`` are the states before it that were not sent earlier, with their serial numbers.
    """

    serial: int
    state: str
    steps: list[tuple[int, str]]
    events: list[LiveEvent]
    samples: list[tuple[int, Sample]]
    motors: MotorsOut | None


def lanes() -> tuple[Lanes, Lanes]:
    """Return the ends of the pipes on the partner's side and on the server's."""
    (asking, asked), (stopping, stopped) = Pipe(), Pipe()
    return Lanes(asked, stopped), Lanes(asking, stopping)


class Post:
    """Sends from a thread of its own: the caller never waits."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._waiting: SimpleQueue[bytes] = SimpleQueue()
        threading.Thread(target=self._run, name="post", daemon=True).start()

    def send(self, message: object) -> None:
        """Hand a message over."""
        self._waiting.put(pickle.dumps(message))

    def _run(self) -> None:
        with suppress(OSError):  # the other side has gone
            while True:
                self._connection.send_bytes(self._waiting.get())
