"""What servers and pages see of a live partner, whichever process its loop runs in.

:class:`miburi.live.runner.Runner` is a :class:`LivePartner`, and so is
:class:`miburi.live.crossing.far.FarPartner`, which represents a runner in another process.
"""

from abc import ABC, abstractmethod
from collections import deque
from concurrent.futures import Future
from datetime import UTC, datetime
from operator import attrgetter, itemgetter
from pathlib import Path
from typing import Protocol

from miburi.errors import MiburiError
from miburi.feelings import Temperament
from miburi.gestures import Repertoire
from miburi.ground.newer import newer
from miburi.live.events.log import History
from miburi.live.recording.archive import Kept
from miburi.live.state import MotorsOut, Sample, Snapshot
from miburi.live.wishes import Granted, Wish
from miburi.robot import Robot
from miburi.serving.press import PRESSED, Press

#: How many samples are kept (two minutes' worth), and how many states (five seconds' worth).
_SAMPLED, _STEPPED = 1200, 250


class UnreachableError(MiburiError):
    """The partner's loop was abandoned, or its process does not answer."""

    def __init__(
        self,
        words: str = "the partner cannot be reached now. If that lasts, look at the robot, and "
        "start `miburi run` again.",
    ) -> None:
        super().__init__(words)


class Recordings(Protocol):
    """The recordings of a live partner; calls may wait for the disk."""

    #: The largest total size of all recordings, in bytes.
    limit: int

    @property
    def current(self) -> str | None:
        """The name of the present recording, or None."""

    def kept(self) -> list[Kept]:
        """Return all recordings, the oldest first."""

    def find(self, name: str) -> Path:
        """Return the file of a finished recording."""

    def start(self) -> None:
        """Begin a recording unless one is running."""

    def end(self) -> None:
        """Finish the present recording, if there is one."""

    def delete(self, name: str) -> None:
        """Delete a finished recording."""


class LivePartner(ABC):
    """A partner that runs in real time; any thread may read it and send requests.

    Attributes
    ----------
    robot, repertoire, recordings
        The robot's description, the gestures, and the recordings.
    own_temperament, temperaments
        ``own_temperament`` is the partner's first temperament. ``temperaments`` holds the names of
        all that can be chosen: Miburi's temperaments, and the partner's first.
    history
        The log of events, which survives restarts.
    snapshot
        The latest state.
    motors
        The state of the motors, at most a second old.
    since
        When it began to run.
    """

    robot: Robot
    repertoire: Repertoire
    recordings: Recordings
    own_temperament: Temperament
    temperaments: list[str]
    history: History
    snapshot: Snapshot
    motors: MotorsOut

    def __init__(self) -> None:
        self.since = datetime.now(UTC)
        self._samples: deque[tuple[int, Sample]] = deque(maxlen=_SAMPLED)
        self._steps: deque[Snapshot] = deque(maxlen=_STEPPED)

    @property
    def body_name(self) -> str:
        """The kind of the present body."""
        return self.snapshot.state.body

    def samples_after(self, serial: int) -> list[tuple[int, Sample]]:
        """Return the samples after the step ``serial``, each with its step's serial number."""
        return newer(self._samples, serial, itemgetter(0))

    def steps_after(self, serial: int) -> list[Snapshot]:
        """Return the states after the step ``serial``, the oldest first."""
        return newer(self._steps, serial, attrgetter("serial"))

    @property
    @abstractmethod
    def reachable(self) -> bool:
        """Whether the loop answers; if not, the snapshot is an old one."""

    @property
    @abstractmethod
    def read_until(self) -> float:
        """The time up to which all messages have been read, in s; all processes share its clock."""

    @abstractmethod
    def ask(self, wish: Wish[Granted]) -> Future[Granted]:
        """Send a request; return a future for the answer, or for the error if it is refused.

        A ``slow`` request may block the caller's thread. An impossible request is refused at once.
        """

    @abstractmethod
    def stop(self, press: Press = PRESSED) -> Future[None]:
        """Stop the body until a :class:`Release`, before other commands; this is never refused."""
