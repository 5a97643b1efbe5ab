"""The log of a live partner: what happened, by number."""

from collections import deque
from typing import Any

from miburi.live.recording import Felt
from miburi.live.state import Entry, StopOut
from miburi.partner import Event, GestureStarted, Released, Stopped, WishLapsed

__all__ = ["LOGGED", "Log"]

#: Entries that are kept.
LOGGED = 300


class Log:
    """The latest entries; one thread writes, any may read."""

    def __init__(self) -> None:
        self._entries: deque[Entry] = deque(maxlen=LOGGED)
        #: The number of the latest entry, from 1.
        self.number = 0

    @property
    def latest(self) -> str | None:
        """What the latest entry names, if anything."""
        return self._entries[-1].name if self._entries else None

    def after(self, number: int) -> list[Entry]:
        """Return the entries that came after one, the oldest first."""
        return [entry for entry in self._entries.copy() if entry.number > number]

    def holds(self, kind: str, name: str) -> bool:
        """Whether an entry of this kind names this."""
        return any(entry.kind == kind and entry.name == name for entry in self._entries)

    def note(self, time: float, kind: str, **content: Any) -> Entry:
        """Add an entry with the fields of its kind at a time, s; return it."""
        self.number += 1
        entry = {"number": self.number, "time": round(time, 2), "kind": kind, **content}
        self._entries.append(Entry.model_validate(entry))
        return self._entries[-1]

    def feel(self, felt: Felt) -> None:
        """Add what the partner felt, and why."""
        stimulus, impression = felt.stimulus, felt.impression
        self.note(
            felt.time,
            "stimulus",
            feeling=stimulus.feeling,
            strength=stimulus.strength,
            source=stimulus.source,
            detail=impression and impression.reason,
            why=impression and impression.why,
        )

    def take(self, event: Event, time: float, stopped: StopOut | None, limit: float) -> None:
        """Add what people want to know of the partner's events.

        Parameters
        ----------
        event, time
            What has happened, and the body's time, s.
        stopped, limit
            What the body says of its stop, and the running rule's limit, if the event is a stop.
        """
        match event:
            case GestureStarted(_, expression, name):
                feeling, mood = expression.feeling, expression.mood
                self.note(time, "gesture", feeling=feeling, mood=mood, name=name)
            case Stopped(_, stop):
                self.note(time, "stopped", stop=stopped, name=stop.reason, limit=limit)
            case Released():
                self.note(time, "released")
            case WishLapsed(_, expression):
                self.note(time, "lapsed", feeling=expression and expression.feeling)
            case _:
                pass
