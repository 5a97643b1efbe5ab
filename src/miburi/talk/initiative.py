"""When the partner speaks first: a greeting, a question after silence, a date that it was told.

:class:`Initiative` finds a reason to speak first, if any, from the times at which somebody was seen
and heard, the facts that are due, and the clock. The partner never speaks first in quiet hours,
seldom otherwise, and half as often after two remarks that nobody answered. All numbers are our
choice.
"""

from dataclasses import dataclass, field
from datetime import datetime, timedelta
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

Reason = Literal["greeting", "date", "question"]
REASONS: tuple[Reason, ...] = ("greeting", "date", "question")

#: The shortest absence before a greeting, and the shortest silence before a question.
_ABSENCE, _SILENCE = timedelta(hours=3), timedelta(minutes=45)
#: How long a person counts as present after being noticed; and how recently somebody must have come
#: to be greeted, or must have been noticed to be asked a question.
_THERE, _GLIMPSED = timedelta(minutes=10), timedelta(seconds=10)
#: The shortest time between two occasions on which the partner speaks first, and the time after
#: which a first remark without an answer counts as ignored.
_APART, _PATIENCE = timedelta(minutes=30), timedelta(minutes=10)
#: The daily limit is halved each time this many first remarks in a row were ignored.
_IGNORED = 2


class Manners(BaseModel):
    """When it may speak unasked; a person sets this on the page."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        strict=True,
        json_schema_extra={"examples": [{"on": True, "most": 6}]},
    )

    on: bool = Field(default=False, description="Whether it starts conversations at all.")
    most: Annotated[int, Field(ge=1, le=10)] = Field(default=6, description="Times a day, at most.")
    quiet_from: Annotated[int, Field(ge=0, le=23)] = Field(
        default=21, description="The hour at which quiet hours begin."
    )
    quiet_to: Annotated[int, Field(ge=0, le=23)] = Field(
        default=8, description="The hour at which they end; if it is the same, there are none."
    )

    def quiet(self, now: datetime) -> bool:
        """Whether a time is within the quiet hours."""
        begin, end, at = self.quiet_from, self.quiet_to, now.hour
        return begin <= at < end if begin <= end else at >= begin or at < end


@dataclass
class Presence:
    """When somebody was present.

    Attributes
    ----------
    seen, heard
        When a face or a touch was last seen, and when words were last heard.
    came
        When somebody was noticed after an absence.
    """

    seen: datetime | None = None
    heard: datetime | None = None
    came: datetime | None = None

    def notice(self, now: datetime, *, words: bool = False) -> None:
        """Note that somebody is present; ``words`` tells whether they spoke."""
        if self.seen is None or now - self.seen > _ABSENCE:
            self.came = now
        self.seen = now
        if words:
            self.heard = now


@dataclass
class Initiative:
    """Decides when to speak first, and remembers whether people answered.

    Attributes
    ----------
    manners
        What a person allows.
    """

    manners: Manners = field(default_factory=Manners)
    _begun: list[datetime] = field(default_factory=list)  # the first remarks of today
    _ignored: int = 0  # in a row
    _open: datetime | None = None  # the latest first remark that nobody has answered yet
    _greeted: datetime | None = None  # when the latest person to be greeted came

    @property
    def allowance(self) -> int:
        """How many times the partner may speak first today; fewer after ignored first remarks."""
        return max(1, self.manners.most >> (self._ignored // _IGNORED))

    def look(self, now: datetime, presence: Presence, due: bool) -> Reason | None:
        """Return a reason to begin now, or None; call this every few seconds.

        Parameters
        ----------
        now
            The local time where the partner stands.
        due
            Whether a fact from the person present is due today.
        """
        self._take_up(now, presence)
        self._begun = [one for one in self._begun if one.date() == now.date()]
        if not self.manners.on or self.manners.quiet(now):
            return None
        if len(self._begun) >= self.allowance or (self._begun and now - self._begun[-1] < _APART):
            return None
        reason = self._reason(now, presence, due)
        if reason is not None:
            self._begun.append(now)
            self._open = now
        return reason

    def _reason(self, now: datetime, presence: Presence, due: bool) -> Reason | None:
        seen, heard, came = presence.seen, presence.heard, presence.came
        if seen is None or came is None or now - seen > _THERE:
            return None
        spoke_first = heard is not None and heard >= came
        if now - came < _GLIMPSED and not spoke_first and self._greeted != came:
            self._greeted = came
            return "greeting"
        if due:
            return "date"
        silent_since = max(came, heard) if heard else came
        there = now - seen < _GLIMPSED
        return "question" if there and now - silent_since > _SILENCE else None

    def _take_up(self, now: datetime, presence: Presence) -> None:
        """Record whether the latest first remark was answered or ignored."""
        if self._open is None:
            return
        if presence.heard is not None and presence.heard > self._open:
            self._open, self._ignored = None, 0
        elif now - self._open > _PATIENCE:
            self._open, self._ignored = None, self._ignored + 1
