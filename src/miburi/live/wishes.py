"""Requests to a running partner, as data; each class names the type of its answer.

Each class needs a function in :mod:`miburi.live.granting`. Stop is not a wish, as it overtakes all
wishes.
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
    """A request to a live partner; ``Granted`` is the type of the answer."""

    #: Whether the request waits for a disk or a card, and so belongs in a thread.
    slow: ClassVar[bool] = False


@dataclass(frozen=True)
class Feel(Wish[str]):
    """Feel a stimulus; the answer is the event's id."""

    stimulus: Stimulus
    by: By = "person"


@dataclass(frozen=True)
class Sense(Wish[tuple[Stimulus, ...]]):
    """Notice an impression; the answer is the stimuli into which the temperament converts it.

    Distress, and words in the ten minutes after it, change no feeling. Events include the ``words``
    only if the user allows that.
    """

    impression: Impression
    words: str | None = None
    by: By = "person"


@dataclass(frozen=True)
class Lean(Wish[None]):
    """Shift the moods' resting values by ``leaning``, shape (n,); None removes the shift."""

    leaning: Array | None


@dataclass(frozen=True)
class See(Wish[None]):
    """Turn to a face at ``x``, from 0 (a picture's left edge) to 1; None means no face."""

    x: float | None


@dataclass(frozen=True)
class Attend(Wish[None]):
    """Face somebody who is about to speak or waits for an answer; repeat this wish meanwhile."""

    turn: Turn


@dataclass(frozen=True)
class NoteTalk(Wish[LiveEvent]):
    """Log which endpoint gets people's words from now on, or why it failed."""

    where: str
    failure: str | None = None


@dataclass(frozen=True)
class NoteTrouble(Wish[LiveEvent]):
    """Log a fault outside of the loop."""

    what: str


@dataclass(frozen=True)
class Speak(Wish[str]):
    """Say a text, coloured by the present feeling; the answer is the wish's id.

    A new sentence replaces the previous one. If there is a ``tune``, it is played instead of the
    words; each note is [frequency in Hz, duration in s]. ``why`` is for the log.
    """

    text: str
    by: By | None = "person"
    tune: Tune | None = None
    why: str | None = None


@dataclass(frozen=True)
class KeepTime(Wish[None]):
    """Beat time with the arms to sentence ``number``, whose sound begins soon in this rhythm."""

    number: int
    rhythm: Rhythm


@dataclass(frozen=True)
class Perform(Wish[str]):
    """Perform a gesture or key poses once; the answer is the wish's id.

    The request is refused while the partner is paused.
    """

    expression: Expression | None
    poses: Sequence[KeyPose] | None = None
    name: str = "gesture"
    by: By = "person"


@dataclass(frozen=True)
class PerformActs(Wish[str]):
    """Perform acts in place of all others, or after them if ``queued``.

    The answer is the wish's id.
    """

    acts: Sequence[Act]
    queued: bool
    by: By = "person"


@dataclass(frozen=True)
class AllowWords(Wish[LiveEvent]):
    """Include people's words in events from now on, or exclude them and delete the stored ones."""

    allowed: bool
    slow = True


@dataclass(frozen=True)
class Release(Wish[None]):
    """Let a stopped body return to neutral once it is at rest; then let the partner go on.

    A person who looks at the body (``by_person``) may end any stop at any time. A program may not
    end a person's Stop, nor the pause after a contact. The release is refused if Stop was pressed
    after the state with the serial ``seen``. Without ``seen``, the release is refused if Stop was
    pressed after ``came``. This is the time at which the request arrived, in s on the clock that
    all processes share; if it is None, :attr:`LivePartner.read_until`, the earliest possible time,
    is taken.
    """

    by_person: bool = False
    came: float | None = None
    seen: int | None = None


@dataclass(frozen=True)
class Pause(Wish[None]):
    """Rest at neutral if ``paused``; otherwise go on."""

    paused: bool = True
    by: By = "person"


@dataclass(frozen=True)
class MoveHand(Wish[None]):
    """Move the simulated hand to ``position``, shape (3,), in m; None removes the hand.

    Its fingers point ``along``, shape (3,).
    """

    position: Array | None
    along: Array


@dataclass(frozen=True)
class ChangeTemperament(Wish[None]):
    """Change to another temperament of the partner, or to another level of idle motion."""

    name: str
    rest: RestLevel | None = None


@dataclass(frozen=True)
class ChangeBody(Wish[None]):
    """Change to another body, which may take seconds."""

    name: str
    port: str | None = None
    slow = True
