"""What servers and pages see of a live partner, whether its loop runs in their process or not.

:class:`miburi.live.runner.Runner` is a :class:`LivePartner`, and so is
:class:`miburi.live.crossing.far.FarPartner`, whose runner is in another process.
"""

from concurrent.futures import Future
from pathlib import Path
from typing import Protocol

from miburi.errors import MiburiError
from miburi.feelings import Temperament
from miburi.gestures import Repertoire
from miburi.live.events.log import History
from miburi.live.recording.archive import Kept
from miburi.live.state import MotorsOut, Sample, Snapshot
from miburi.live.wishes import Granted, Wish
from miburi.robot import Robot
from miburi.serving.press import PRESSED, Press

__all__ = ["LivePartner", "Recordings", "UnreachableError"]


class UnreachableError(MiburiError):
    """The partner's loop has ended, or its process does not answer."""

    def __init__(
        self,
        words: str = "the partner cannot be reached now. If that lasts, look at the robot, and "
        "start `miburi run` again.",
    ) -> None:
        super().__init__(words)


class Recordings(Protocol):
    """The recordings of a live partner; calls that wait for the disk belong in a thread."""

    @property
    def limit(self) -> int:
        """The largest total size of all recordings, bytes."""

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


class LivePartner(Protocol):
    """A partner that runs in real time; any thread may look at it and ask it for things."""

    @property
    def robot(self) -> Robot:
        """The description."""

    @property
    def repertoire(self) -> Repertoire:
        """The gestures."""

    @property
    def recordings(self) -> Recordings:
        """The recordings."""

    @property
    def temperaments(self) -> list[str]:
        """The temperaments to choose from: those that ship with Miburi, and the partner's first."""

    @property
    def own_temperament(self) -> Temperament:
        """The temperament that it began with."""

    @property
    def reachable(self) -> bool:
        """Whether the loop is alive and answers; if not, the snapshot is an old one."""

    @property
    def snapshot(self) -> Snapshot:
        """The latest state."""

    @property
    def body_name(self) -> str:
        """The kind of body in use now."""

    @property
    def motors(self) -> MotorsOut:
        """The state of the motors, at most a second old."""

    @property
    def read_until(self) -> float:
        """The time up to which all messages have been read, s, on the clock of all processes."""

    @property
    def history(self) -> History:
        """What has happened, across restarts."""

    def samples_after(self, serial: int) -> list[tuple[int, Sample]]:
        """Return the samples after a step, each with its step's serial; two minutes are kept."""

    def steps_after(self, serial: int) -> list[Snapshot]:
        """Return the states after a serial, oldest first; only the last five seconds are kept."""

    def ask(self, wish: Wish[Granted]) -> Future[Granted]:
        """Ask for something; return a future for the answer, or for the error if it is refused.

        A ``slow`` request may block the caller's thread. What is clearly impossible is refused at
        once.
        """

    def stop(self, press: Press = PRESSED) -> Future[None]:
        """Stop the body until a :class:`Release`.

        It is never refused, and precedes other commands.
        """
