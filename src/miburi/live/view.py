"""What servers and pages see of a live partner, whether its loop runs in their process or not.

:class:`miburi.live.runner.Runner` is a :class:`LivePartner`, and so is
:class:`miburi.live.crossing.FarPartner`, behind which the runner has a process of its own.
"""

from collections.abc import Sequence
from concurrent.futures import Future
from pathlib import Path
from typing import Protocol

from miburi.errors import MiburiError
from miburi.feelings import Expression, Stimulus, Temperament
from miburi.feelings.temperament import RestLevel
from miburi.gestures import KeyPose, Repertoire
from miburi.languages.rhythm import Rhythm
from miburi.live.archive import Kept
from miburi.live.events.log import History
from miburi.live.events.model import LiveEvent
from miburi.live.stage import Act
from miburi.live.state import MotorsOut, Sample, Snapshot, Tune
from miburi.robot import Array, Robot
from miburi.senses import Impression
from miburi.serving.press import PRESSED, By, Press

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
    """The recordings of a live partner; what waits for the disk belongs in a thread."""

    @property
    def limit(self) -> int:
        """The largest size of all together, bytes."""

    @property
    def current(self) -> str | None:
        """The name of the present recording, or None."""

    def kept(self) -> list[Kept]:
        """Return all recordings, the oldest first."""

    def find(self, name: str) -> Path:
        """Return the file of an ended recording."""

    def start(self) -> None:
        """Begin a recording unless one is on."""

    def end(self) -> None:
        """Finish the present recording, if there is one."""

    def delete(self, name: str) -> None:
        """Delete an ended recording."""


class LivePartner(Protocol):
    """A partner on the clock; any thread may look at it and ask."""

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
        """The temperaments to choose from: those that ship, and the one that it began with."""

    @property
    def own_temperament(self) -> Temperament:
        """The temperament that it began with."""

    @property
    def reachable(self) -> bool:
        """Whether the loop lives and answers; while it does not, the snapshot is an old one."""

    @property
    def snapshot(self) -> Snapshot:
        """The latest state."""

    @property
    def body_name(self) -> str:
        """The kind of body that moves now."""

    @property
    def motors(self) -> MotorsOut:
        """How the motors are, at most a second old."""

    @property
    def read_until(self) -> float:
        """Whatever came before this has been read by now; s on the clock of all processes."""

    @property
    def history(self) -> History:
        """What has happened, over restarts."""

    def samples_after(self, serial: int) -> list[tuple[int, Sample]]:
        """Return the samples of the last two minutes after a step, with their steps' serials."""

    def steps_after(self, serial: int) -> list[Snapshot]:
        """Return the states after one, the oldest first; at most those of the last five seconds."""

    def stimulate(self, stimulus: Stimulus, by: By = "person") -> Future[str]:
        """Let the partner feel something; returns the event's id."""

    def take(self, heard: Impression, words: str | None = None) -> Future[tuple[Stimulus, ...]]:
        """Let the partner take what somebody showed, as its temperament does; the log says why.

        The result is what it felt at that. Distress is an event, and
        moves no feeling; for ten minutes after, neither does anything that is heard. Events tell
        the ``words`` only if the user allows that.
        """

    def lean(self, leaning: Array | None) -> Future[None]:
        """Let moods rest (n,) off the temperament's while a person is there; None: no more."""

    def see(self, x: float | None) -> Future[None]:
        """Let the partner turn to a face at ``x``, 0 to 1 of a picture's width; None: to none."""

    def note_talk(self, where: str, failure: str | None = None) -> Future[LiveEvent]:
        """Note where what is said to it goes from now on, or why no reply came from there."""

    def speak(
        self,
        text: str,
        by: By | None = "person",
        tune: Tune | None = None,
        why: str | None = None,
    ) -> Future[str]:
        """Let the partner say something aloud, coloured by what it feels; the latest wish wins.

        A ``tune`` of [Hz, s] notes is played instead of the words. ``why`` is for the log.
        This and what follows return the wish's id, which later events carry.
        """

    def keep_time(self, number: int, rhythm: Rhythm) -> Future[None]:
        """Beat to the sound of a sentence, by its number, which is known now and soon heard."""

    def perform(
        self,
        expression: Expression | None,
        poses: Sequence[KeyPose] | None = None,
        name: str = "gesture",
        by: By = "person",
    ) -> Future[str]:
        """Perform a gesture once; refused while the partner rests."""

    def act(self, acts: Sequence[Act], queued: bool, by: By = "person") -> Future[str]:
        """Perform acts in their order, after what waits or instead of what is on."""

    def allow_words(self, allowed: bool) -> Future[LiveEvent]:
        """Let events tell what is said to the partner from now on, or forget what was said."""

    def stop(self, press: Press = PRESSED) -> Future[None]:
        """Stop the body until :meth:`release`; never refused, and before any other command."""

    def release(
        self, *, by_person: bool = False, came: float | None = None, seen: int | None = None
    ) -> Future[None]:
        """Let a stopped body go back to neutral as soon as it has come to rest, and go on.

        A person who looks at the body (``by_person``) may end any stop at any time. A program may
        not end a person's Stop, nor the pause after a contact. Nobody may where Stop has been
        pressed since the state that was ``seen``, by its serial; without it, since the wish
        ``came``, s on the clock of all processes; None: as early as it may be
        (:attr:`read_until`).
        """

    def pause(self, paused: bool) -> Future[None]:
        """Rest at neutral, or go on."""

    def hand(self, position: Array | None, along: Array) -> Future[None]:
        """Let the simulated human hand go somewhere, or away (None)."""

    def temperament(self, name: str, rest: RestLevel | None = None) -> Future[None]:
        """Go on with another of the :attr:`temperaments`, or with one that rests in another way."""

    def use(self, name: str, port: str | None = None) -> Future[None]:
        """Move another body from now on; it may take seconds to make it."""
