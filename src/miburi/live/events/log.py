"""The log of a live partner: numbered events, across restarts.

The latest events are in memory, older ones in an :class:`~miburi.live.events.store.EventStore`. A
thread writes events to the disk, so that a slow disk does not hold up the partner's loop.
"""

import math
import sqlite3
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterable
from contextlib import suppress
from datetime import UTC, datetime, timedelta
from operator import attrgetter
from queue import Empty, SimpleQueue
from typing import Any
from uuid import uuid4

from miburi.errors import OutputError
from miburi.ground.log import log_once
from miburi.ground.newer import newer
from miburi.live.events.event import Cursor, LiveEvent, without_words
from miburi.live.events.store import EventStore

#: The number of events kept in memory.
LOGGED = 300
_LOST = "events before this one are no longer kept"
_UNKNOWN = (
    "this partner does not know that event: the id is wrong, the partner keeps its events in "
    "another folder, its file of events was lost, or it was killed before it had written that event"
)
#: The name of the note in the store that says whether events may contain people's words.
_WORDS = "words"
#: How long to wait for the disk, and how long between two tries to write, both in s.
_PATIENCE, _AGAIN = 2.0, 1.0
#: The most events that may wait for the disk, and the most that are written at once (our choice).
_MOST, _AT_ONCE = 5_000, 100


def _now() -> datetime:
    return datetime.now(UTC)


class History:
    """The events so far; one thread adds events, and any thread may read them.

    Parameters
    ----------
    boot, first
        The id of the current run, and the number of its first event.
    store
        The store of older events, if any.
    """

    def __init__(self, boot: str, first: int, store: EventStore | None = None) -> None:
        self.boot, self.first = boot, first
        #: The number of the latest event.
        self.number = first - 1
        self._oldest = first
        self._events: deque[LiveEvent] = deque(maxlen=LOGGED)
        self._store = store

    def add(self, events: Iterable[LiveEvent]) -> None:
        """Add new events; when people's words are no longer allowed, forget those in memory."""
        for event in events:
            if event.kind == "words" and event.name == "off":
                self._events = deque(map(without_words, self._events), maxlen=LOGGED)
            self._events.append(event)
            self.number = event.number
        if self._events:
            self._oldest = self._events[0].number

    @property
    def latest(self) -> LiveEvent | None:
        """The latest event of this run."""
        return self._events[-1] if self._events else None

    def after(self, number: int) -> list[LiveEvent]:
        """Return the events in memory with greater numbers, oldest first."""
        return newer(self._events, number, attrgetter("number"))

    def reaches(self, cursor: Cursor) -> bool:
        """Whether all events after a cursor are in memory, so that reading needs no disk."""
        ours = cursor.boot in (None, self.boot) and cursor.number <= self.number
        return ours and cursor.number >= self._oldest - 1

    def since(self, cursor: Cursor, most: int) -> list[LiveEvent]:
        """Return at most ``most`` events after a cursor, the oldest first.

        A ``gap`` stands where events are not kept any more; if the cursor names no event that this
        partner has kept, the list begins with a ``gap``.
        """
        if self.reaches(cursor):
            return self.after(cursor.number)[:most]
        pruned = self._oldest - 1 if self._store is None else self._store.pruned
        start, missing = self._resolve(cursor, pruned)
        if start >= self._oldest - 1:
            events = self.after(start)[:most]
        else:
            events = self._store.read(start, most) if self._store else []
            if len(events) < most:
                last = events[-1].number if events else start
                events += self.after(last)[: most - len(events)]
        told = [] if missing is None else [self._gap(start, events[0] if events else None, missing)]
        last = max(start, pruned)
        for event in events:
            if event.number > last + 1:  # a disk was full, or too slow
                told.append(self._gap(event.number - 1, event, _LOST))
            last = max(event.number, pruned)
            told.append(event)
        return told

    def recall(self, who: str) -> Cursor | None:
        """Return the stored cursor, up to which a reader has all events; None if none is stored."""
        kept = self._store.note(f"told {who}") if self._store else None
        return None if kept is None else Cursor.of(kept)

    def remember(self, who: str, cursor: Cursor) -> None:
        """Store the cursor of a reader, who has all events up to it; this waits for the disk."""
        if self._store is not None:
            try:
                self._store.set_note(f"told {who}", str(cursor))
            except sqlite3.Error as error:
                log_once("events are not kept", error)

    def _resolve(self, cursor: Cursor, pruned: int) -> tuple[int, str | None]:
        """Return the number after which a reader continues, and why events are missing."""
        boot, number = cursor
        end = None
        if boot == self.boot or (boot is None and number <= self.number):
            end = self.number
        elif boot is not None and self._store is not None:
            end = self._store.end_of(boot)
        start = 0 if end is None else min(number, end)
        missing = _UNKNOWN if end is None or number > end else None
        if missing is None and start < pruned:
            missing = _LOST
        return start if self._store else max(start, pruned), missing

    def _gap(self, number: int, after: LiveEvent | None, why: str) -> LiveEvent:
        after = after or self.latest
        boot, wall = (after.boot, after.wall) if after is not None else (self.boot, _now())
        time = 0.0 if after is None else after.time
        return LiveEvent(boot=boot, number=number, wall=wall, time=time, kind="gap", detail=why)


class Log:
    """Records events; only the loop's thread adds to it.

    If there is a ``store``, it keeps the events beyond this program's end. ``boot`` is the id of
    this run (8 hex digits), by default a new one; ``now`` returns the computer's time.
    """

    def __init__(
        self,
        store: EventStore | None = None,
        boot: str | None = None,
        now: Callable[[], datetime] = _now,
    ) -> None:
        boot, first = boot or uuid4().hex[:8], 1
        #: Whether words said to the partner may be reported and stored.
        self.words = False
        if store is not None:
            try:
                first, self.words = store.begin(boot), store.note(_WORDS) == "1"
                if not self.words:  # an earlier version may have left some
                    with suppress(sqlite3.Error):  # another program reads; the next start may
                        store.forget_words(aside=False)
            except sqlite3.Error as error:  # no room, no permission, or locked by another program
                lost = "Events will be lost when the program ends."
                print(f"miburi: events cannot be kept: {error}. {lost}", file=sys.stderr)
                store = None
        self._store, self._now = store, now
        self.history = History(boot, first, store)
        self._told: SimpleQueue[LiveEvent | threading.Event | None] = SimpleQueue()
        self._thread: threading.Thread | None = None
        if store is not None:
            writing = (store, self._told)
            self._thread = threading.Thread(target=_write, args=writing, name="events", daemon=True)
            self._thread.start()

    def allow_words(self, allowed: bool) -> None:
        """Allow people's words in events from now on, or delete them; this waits for the disk.

        Raises OutputError if the file cannot be written; then the setting is as it was.
        """
        before, self.words = self.words, self.words and allowed  # no more meanwhile
        try:
            if self._store is not None and not allowed:
                self._told.put(written := threading.Event())
                written.wait(_PATIENCE)
                self._store.forget_words()
            if self._store is not None:
                self._store.set_note(_WORDS, "1" if allowed else "0")
        except (sqlite3.Error, OSError) as error:
            self.words = before
            raise OutputError(
                f"this could not be changed for good: {error}. Make room on the disk, or make it "
                "writable, and try again."
            ) from error
        self.words = allowed

    def holds(self, kind: str, name: str, seconds: float = math.inf) -> bool:
        """Whether an event in memory, at most ``seconds`` s old, has this kind and name."""
        since = self._now() - timedelta(seconds=min(seconds, 1e9))
        events = self.history.after(0)
        return any(e.kind == kind and e.name == name and e.wall >= since for e in events)

    def note(self, time: float, kind: str, **content: Any) -> LiveEvent:
        """Record an event at ``time`` (in s) with the fields of its kind; return it."""
        now = self._now()
        wall = now.replace(microsecond=now.microsecond // 1000 * 1000)
        stamp = {"boot": self.history.boot, "number": self.history.number + 1, "wall": wall}
        event = LiveEvent.model_validate({**stamp, "time": round(time, 2), "kind": kind, **content})
        self.history.add([event])
        if self._thread is not None:
            self._told.put(event if self.words else without_words(event))
        return event

    def close(self, patience: float = _PATIENCE) -> None:
        """Write the queued events, and end the writing thread."""
        if self._thread is not None:
            self._told.put(None)
            self._thread.join(patience)
            self._thread = None


def _write(store: EventStore, told: "SimpleQueue[LiveEvent | threading.Event | None]") -> None:
    """Write batches from the queue until a None arrives; at a flag, forget words and set the flag.

    After a second without events, the file itself has all of them.
    """
    left: list[LiveEvent] = []
    ended, settled = False, True
    while not ended:
        waiting: list[LiveEvent | threading.Event | None] = []
        with suppress(Empty):
            waiting.append(told.get(timeout=None if settled and not left else _AGAIN))
            waiting += [told.get_nowait() for _ in range(told.qsize())]
        left = [*left, *(one for one in waiting if isinstance(one, LiveEvent))][-_MOST:]
        flags = [one for one in waiting if isinstance(one, threading.Event)]
        if flags:
            left = [*map(without_words, left)]
        settled = settled and not left
        try:
            while left:
                store.write(left[:_AT_ONCE])
                del left[:_AT_ONCE]
            if not waiting and not settled:  # a quiet second
                settled = True
                store.settle()
        except sqlite3.Error as error:  # no room, or locked; later it may work
            log_once("events are not kept", error)
        for flag in flags:
            flag.set()
        ended = None in waiting
