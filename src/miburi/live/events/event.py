"""One event of a live partner, and the cursor: the last event that a reader knows."""

import re
from datetime import UTC, datetime
from typing import Annotated, Literal, NamedTuple

from pydantic import AwareDatetime, BaseModel, Field, PlainSerializer, computed_field

from miburi.errors import BodyError, InputError
from miburi.live.state import EndReason, StopOut
from miburi.senses import Brought
from miburi.serving.press import By

EventKind = Literal[
    "started",
    "stimulus", "heard", "distress",
    "wish", "wish_dropped",
    "gesture_begun", "gesture_ended", "gesture_broken_off",
    "speech_begun", "speech_ended", "speech_broken_off",
    "performance_begun", "performance_ended", "performance_broken_off",
    "pressed", "stop", "release_begun", "release_ended", "release_broken_off",
    "paused", "resumed", "body", "temperament", "words",
    "recording", "recorded", "recording_ended", "deleted",
    "talk", "talk_failed", "refused", "trouble", "loop_failed",
    "gap",
]  # fmt: skip


def _iso(moment: datetime) -> str:
    return moment.astimezone(UTC).isoformat(timespec="milliseconds")


#: A moment in UTC; in JSON as ISO 8601 with milliseconds.
Wall = Annotated[AwareDatetime, PlainSerializer(_iso, return_type=str, when_used="json")]

#: Kinds of events with words that were said to the partner, and with sentences that it says. Those
#: sentences that nobody asked for in these words are answers, which may repeat what was said.
SAID = ("heard", "distress")
SPOKEN = ("speech_begun", "speech_ended", "speech_broken_off")
#: The fields that such events lose if words are not allowed.
WORDS = ("text", "why", "detail")
#: What a cursor looks like.
CURSOR = r"^(?:([0-9a-f]{8}):)?([0-9]{1,15})$"


class Cursor(NamedTuple):
    """The latest event that a reader has received: its number, and the run that it belongs to.

    ``boot`` is None for a bare number.
    """

    boot: str | None
    number: int

    @classmethod
    def of(cls, text: str) -> "Cursor":
        """Return the cursor that a text names, as ``BOOT:NUMBER`` or as ``NUMBER``.

        Raises InputError if the text is not a cursor.
        """
        found = re.match(CURSOR, text.strip())
        if found is None:
            raise InputError(
                f"an event is named BOOT:NUMBER, such as 5f2c9a10:42, or NUMBER; got {text[:40]!r}."
            )
        return cls(found[1], int(found[2]))

    def __str__(self) -> str:
        return str(self.number) if self.boot is None else f"{self.boot}:{self.number}"


class LiveEvent(BaseModel):
    """Something that happened; fields that its kind does not need are null."""

    boot: str = Field(
        description="The id of the partner's run that it belongs to.", examples=["5f2c9a10"]
    )
    number: int = Field(
        ge=0,
        description="Counts up by one, even across restarts that use the same folder.",
        examples=[42],
    )
    wall: Wall = Field(description="When, by the computer's clock, UTC.")
    time: float = Field(description="When, by the robot's clock, s since this start.")
    kind: EventKind = Field(description="What happened.")
    by: By | None = Field(
        default=None,
        description="Who caused it: a person, a smart home's button, an agent (MCP), ROS, a "
        "program; or "
        "the partner itself, while nobody could reach it.",
    )
    wish: str | None = Field(
        default=None, description="The id of the request that led to it, if any."
    )
    feeling: str | None = Field(default=None, description="The feeling that is felt or shown.")
    mood: float | None = Field(default=None, description="The mood with which it is shown, 0 to 1.")
    strength: float | None = Field(default=None, description="A stimulus's strength, 0 to 1.")
    source: str | None = Field(default=None, description="What a stimulus came from.")
    name: str | None = Field(
        default=None,
        description="The name of what it is about: a gesture, a recording, a body, a reason.",
    )
    text: str | None = Field(
        default=None,
        description="What the partner said. What was said to it, and its own answers, which may "
        "repeat that, appear here only if the user allows it.",
    )
    reason: EndReason | None = Field(default=None, description="Why a recording ended by itself.")
    detail: str | None = Field(
        default=None,
        description="More about it, in words; of `pressed` and `stop`, when Stop was pressed, if "
        "that was before this start.",
    )
    why: tuple[Brought, ...] | None = Field(
        default=None,
        description="The evidence for the stimulus: words, or a sensed event such as a stroke.",
    )
    stop: StopOut | None = Field(default=None, description="What is known about a stop.")
    limit: float | None = Field(default=None, description="The contact rule's limit at that stop.")

    @computed_field(description="BOOT:NUMBER, which identifies it across restarts.")  # type: ignore[prop-decorator]
    @property
    def id(self) -> str:
        """Return the id that identifies the event across restarts."""
        return f"{self.boot}:{self.number}"

    @property
    def cursor(self) -> Cursor:
        """Return the cursor of a reader whose latest event is this one."""
        return Cursor(self.boot, self.number)


def without_words(event: LiveEvent) -> LiveEvent:
    """Return a copy of the event without people's words and answers that may repeat them."""
    answers = event.kind in SPOKEN and event.by in (None, "partner")
    if event.kind in SAID or event.source == "speech" or answers:
        return event.model_copy(update=dict.fromkeys(WORDS))
    return event


class EndOfWish:
    """Finds the event that ends a wish.

    Raises InputError if the text is not the id of a wish.

    Parameters
    ----------
    wish
        The wish's id, ``BOOT:NUMBER``.
    """

    def __init__(self, wish: str) -> None:
        self._wish, self._boot, self._what = wish, Cursor.of(wish).boot, ""
        if self._boot is None:
            raise InputError(f"a wish's id is BOOT:NUMBER, got {wish!r}.")

    @property
    def before(self) -> str:
        """The cursor of a reader who has not yet heard of the wish."""
        return str(Cursor(self._boot, max(Cursor.of(self._wish).number - 1, 0)))

    def check(self, events: list[LiveEvent]) -> None:
        """Check that the first of the events after :attr:`before` is the wish.

        Raises
        ------
        InputError
            The first event is something else, which never ends, or there is no event.
        """
        what, first = "", events[0] if events else None
        if first is None:
            what = "does not exist"
        elif first.boot == self._boot and first.number < Cursor.of(self.before).number:
            what = "does not exist"  # the gap is at the newest event
        elif first.boot == self._boot and first.kind not in ("wish", "gap"):
            what = f"is of the kind {first.kind}"
        if what:
            raise InputError(
                f"{self._wish} {what}; this takes the id of a request such as express or speak."
            )

    def is_in(self, event: LiveEvent) -> bool:
        """Whether this event ends the wish; pass the events in their order.

        Raises BodyError if nobody can know how the wish ended: the partner was restarted, or no
        longer has these events.
        """
        if event.boot != self._boot:
            raise BodyError("the partner was restarted, so it is unknown how that request ended.")
        if event.kind == "gap":
            raise BodyError(f"it is unknown how that request ended: {event.detail}.")
        if event.wish != self._wish:
            return False
        what, _, how = event.kind.partition("_")
        if how == "begun" and not self._what:
            self._what = what  # a performance's acts begin and end, too
        return event.kind == "wish_dropped" or (
            how in ("ended", "broken_off") and what == (self._what or what)
        )
