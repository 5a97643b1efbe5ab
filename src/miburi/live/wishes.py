"""Requests to a running partner, as data; each class names the type of its answer.

To add one, add a class here and a function in :mod:`miburi.live.granting`; all interfaces can then
use it. Stop is not a wish: it has a lane of its own.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Generic, TypeVar

from miburi.feelings import Expression, Stimulus
from miburi.feelings.temperament import RestLevel
from miburi.gestures import KeyPose
from miburi.languages.rhythm import Rhythm
from miburi.live.attention import Turn
from miburi.live.events.event import LiveEvent
from miburi.live.stage import Act
from miburi.live.state import Tune
from miburi.robot import Array
from miburi.senses import Impression
from miburi.serving.press import By

Granted = TypeVar("Granted")


class Wish(Generic[Granted]):
    """A request to a live partner, which is answered with a ``Granted``."""

    #: Whether asking for it waits for a disk or a card, and so belongs in a thread.
    slow: ClassVar[bool] = False


@dataclass(frozen=True)
class Feel(Wish[str]):
    """Feel a stimulus; the answer is the event's id."""

    stimulus: Stimulus
    by: By = "person"


@dataclass(frozen=True)
class Sense(Wish[tuple[Stimulus, ...]]):
    """Notice what somebody showed; the answer is the stimuli that the temperament makes of it.

    Distress is an event and changes no feeling; nor does anything heard in the ten minutes after
    it. Events include the ``words`` only if the user allows that.
    """

    impression: Impression
    words: str | None = None


@dataclass(frozen=True)
class Lean(Wish[None]):
    """While a person is there, shift the moods' resting values by ``leaning`` (n,).

    None removes the leaning.
    """

    leaning: Array | None


@dataclass(frozen=True)
class See(Wish[None]):
    """Turn to a face at ``x``, 0 to 1 of a picture's width; None: there is no face."""

    x: float | None


@dataclass(frozen=True)
class Attend(Wish[None]):
    """Face somebody who is about to speak or waits for an answer; repeat it while that lasts."""

    turn: Turn


@dataclass(frozen=True)
class NoteTalk(Wish[LiveEvent]):
    """Log which endpoint gets people's words from now on, or why it failed."""

    where: str
    failure: str | None = None


@dataclass(frozen=True)
class Speak(Wish[str]):
    """Say something aloud, coloured by what is felt; the answer is the wish's id.

    A new sentence replaces the one before. A ``tune`` of [Hz, s] notes is played instead of the
    words. ``why`` is for the log.
    """

    text: str
    by: By | None = "person"
    tune: Tune | None = None
    why: str | None = None


@dataclass(frozen=True)
class KeepTime(Wish[None]):
    """Beat with the arms to sentence ``number``, whose sound begins soon and has this rhythm."""

    number: int
    rhythm: Rhythm


@dataclass(frozen=True)
class Perform(Wish[str]):
    """Perform a gesture or key poses once, not while paused; the answer is the wish's id."""

    expression: Expression | None
    poses: Sequence[KeyPose] | None = None
    name: str = "gesture"
    by: By = "person"


@dataclass(frozen=True)
class PerformActs(Wish[str]):
    """Perform acts in their order, after those that wait or in place of the present ones."""

    acts: Sequence[Act]
    queued: bool
    by: By = "person"


@dataclass(frozen=True)
class AllowWords(Wish[LiveEvent]):
    """Include people's words in events from now on, or leave them out and delete those stored."""

    allowed: bool
    slow = True


@dataclass(frozen=True)
class Release(Wish[None]):
    """Let a stopped body go back to neutral as soon as it has come to rest, and go on.

    A person who looks at the body (``by_person``) may end any stop at any time. A program may not
    end a person's Stop, nor the pause after a contact. The release is refused if Stop has been
    pressed since the state with the serial ``seen``. Without ``seen``, it is refused if Stop was
    pressed after ``came``, the time at which this request arrived, s on the clock that all
    processes share. None stands for the earliest possible time, :attr:`LivePartner.read_until`.
    """

    by_person: bool = False
    came: float | None = None
    seen: int | None = None


@dataclass(frozen=True)
class Pause(Wish[None]):
    """Rest at neutral, or go on."""

    paused: bool = True


@dataclass(frozen=True)
class MoveHand(Wish[None]):
    """Move the simulated hand to ``position`` (3,), m; None takes it away.

    Its fingers point along ``along`` (3,).
    """

    position: Array | None
    along: Array


@dataclass(frozen=True)
class ChangeTemperament(Wish[None]):
    """Change to another of the partner's temperaments, or to another level of idle motion."""

    name: str
    rest: RestLevel | None = None


@dataclass(frozen=True)
class ChangeBody(Wish[None]):
    """Change to another body; creating it may take seconds."""

    name: str
    port: str | None = None
    slow = True
