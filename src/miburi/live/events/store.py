"""The SQLite file of a partner's events: those of the last month, and stops of the last year.

The partner's process writes the file, and the server's process reads it. Committed events survive
if the program is killed; a power cut may lose the last moments. Besides events, the file holds
the number of each run's first event, and small notes, such as the last event that a smart home has
received.
"""

import sqlite3
import sys
import threading
import weakref
from collections.abc import Iterable
from contextlib import suppress
from datetime import timedelta
from pathlib import Path

from pydantic import ValidationError

from miburi.errors import OutputError
from miburi.ground.files import put_aside, put_aside_before
from miburi.live.events.event import SAID, SPOKEN, WORDS, LiveEvent

#: How many events are kept, and for how long; those about stops are kept for a year (our choice).
KEPT, MONTH, YEAR = 100_000, timedelta(days=30), timedelta(days=365)
#: This many events are kept whatever their age, since a computer's clock may start in 1970. Of
#: the times of these events, a tenth are earlier than the time that is taken to be the present, so
#: that a few wrong times have no effect.
SURE = 1_000
#: Events written between two prunings.
_PRUNED_EVERY = 1_000
_STOPS = ("stop", "pressed", "release_begun")
_TABLES = """
CREATE TABLE IF NOT EXISTS events
    (number INTEGER PRIMARY KEY, wall REAL NOT NULL, long INTEGER NOT NULL, content TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS boots (boot TEXT PRIMARY KEY, first INTEGER NOT NULL);
CREATE TABLE IF NOT EXISTS notes (name TEXT PRIMARY KEY, value TEXT NOT NULL);
"""
_OLD = """
    number <= :sure AND (wall < :year OR (NOT long AND (number <= :kept OR wall < :month)))
"""
_PRESENT = """
SELECT wall FROM (SELECT wall FROM events ORDER BY number DESC LIMIT :sure)
    ORDER BY wall LIMIT 1 OFFSET :tenth
"""
_FIELDS = ", ".join(f"'$.{field}'" for field in WORDS)
#: The same as ``without_words``, for all events.
_FORGET = f"""
UPDATE events SET content = json_remove(content, {_FIELDS})
    WHERE json_extract(content, {_FIELDS}) <> '[null,null,null]'
    AND (json_extract(content, '$.kind') IN {SAID}
        OR json_extract(content, '$.source') = 'speech'
        OR (json_extract(content, '$.kind') IN {SPOKEN}
            AND ifnull(json_extract(content, '$.by'), 'partner') = 'partner'))
"""  # noqa: S608  # our own words
#: After as many pages, 4 KB each, the journal is copied into the file (our choice).
_PAGES = 50


class EventStore:
    """The events of one folder; any thread may use it.

    Raises OutputError if the file cannot be written.

    Parameters
    ----------
    path
        The file; if it is not our database, or is damaged, it is put aside as ``*.bad``, and a new
        one is begun.
    """

    def __init__(self, path: Path) -> None:
        self._path, self._lock = path, threading.Lock()
        self._written = _PRUNED_EVERY  # since the last pruning
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            try:
                self._file = self._open()
            except sqlite3.DatabaseError as error:
                if isinstance(error, sqlite3.OperationalError):
                    raise  # no room, or no permission: the file may be good
                aside = put_aside(path)
                print(
                    f"miburi: {path} cannot be used, so a new file was started; the old one is "
                    f"kept as {aside.name}: {error}.",
                    file=sys.stderr,
                )
                for suffix in ("-wal", "-shm"):
                    path.with_name(path.name + suffix).unlink(missing_ok=True)
                self._file = self._open()
        except (sqlite3.Error, OSError) as error:
            raise OutputError(f"{path}: events cannot be kept there: {error}.") from error
        weakref.finalize(self, self._file.close)

    def _open(self) -> sqlite3.Connection:
        file = sqlite3.connect(self._path, timeout=5.0, check_same_thread=False)
        try:
            file.execute("PRAGMA journal_mode=WAL")
            file.execute("PRAGMA synchronous=NORMAL")
            file.execute("PRAGMA secure_delete=ON")
            file.execute(f"PRAGMA wal_autocheckpoint={_PAGES}")
            file.executescript(_TABLES)
            if file.execute("PRAGMA quick_check(1)").fetchone() != ("ok",):
                raise sqlite3.DatabaseError("it is damaged")  # as by a power cut
        except sqlite3.Error:
            file.close()
            raise
        return file

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            self._file.close()

    @property
    def pruned(self) -> int:
        """The highest number of an event deleted for its age, or 0."""
        return int(self.note("pruned") or 0)

    def begin(self, boot: str) -> int:
        """Note the start of a run; return the number of its first event."""
        with self._lock, self._file:
            kept = "SELECT max(number) FROM events UNION SELECT max(first) - 1 FROM boots"
            rows = self._file.execute(kept).fetchall()
            first = max(number or 0 for (number,) in rows) + 1
            self._file.execute("INSERT INTO boots VALUES (?, ?)", (boot, first))
        return first

    def end_of(self, boot: str) -> int | None:
        """Return the last event number that a run may have used; None if the run is unknown.

        It is 2**53, above any event's number, for the latest run.
        """
        with self._lock:
            first = self._file.execute("SELECT first FROM boots WHERE boot = ?", (boot,)).fetchone()
            if first is None:
                return None
            after = "SELECT min(first) FROM boots WHERE first > ?"
            (then,) = self._file.execute(after, first).fetchone()
        return int(then) - 1 if then is not None else 2**53

    def write(self, events: Iterable[LiveEvent]) -> None:
        """Add all events, or none.

        Raises sqlite3.Error if the file cannot be written.
        """
        rows = [
            (
                event.number,
                event.wall.timestamp(),
                event.kind in _STOPS,
                event.model_dump_json(exclude_none=True, exclude={"id"}),
            )
            for event in events
        ]
        with self._lock, self._file:
            self._file.executemany("INSERT OR REPLACE INTO events VALUES (?, ?, ?, ?)", rows)
            self._written += len(rows)
            if self._written >= _PRUNED_EVERY:
                self._written = 0
                self._prune()

    def read(self, after: int, most: int) -> list[LiveEvent]:
        """Return at most ``most`` events after a number, the oldest first."""
        query = "SELECT content FROM events WHERE number > ? ORDER BY number"
        events: list[LiveEvent] = []
        with self._lock:
            for (content,) in self._file.execute(query, (after,)):
                with suppress(ValidationError):  # an event of another version; readers see a gap
                    events.append(LiveEvent.model_validate_json(content))
                if len(events) >= most:
                    break
        return events

    def note(self, name: str) -> str | None:
        """Return a small note, or None."""
        with self._lock:
            query = "SELECT value FROM notes WHERE name = ?"
            row = self._file.execute(query, (name,)).fetchone()
        return None if row is None else str(row[0])

    def set_note(self, name: str, value: str) -> None:
        """Keep a small note.

        Raises sqlite3.Error if the file cannot be written.
        """
        with self._lock, self._file:
            self._set(name, value)

    def forget_words(self, *, aside: bool = True) -> None:
        """Delete people's words from all events, and every byte of them from the file.

        Damaged files that were put aside are deleted, too, unless ``aside`` is False.

        Raises sqlite3.Error or OSError if the disk does not allow it.
        """
        with self._lock:
            for file in put_aside_before(self._path) if aside else ():
                file.unlink(missing_ok=True)
            with self._file:
                self._file.execute(_FORGET)
            if self._file.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()[0]:
                raise sqlite3.OperationalError("another program reads the events")

    def settle(self) -> None:
        """Copy the journal into the file itself, so that a copy of it has all events."""
        with self._lock:
            self._file.execute("PRAGMA wal_checkpoint(PASSIVE)")

    def _set(self, name: str, value: str) -> None:
        self._file.execute("INSERT OR REPLACE INTO notes VALUES (?, ?)", (name, value))

    def _prune(self) -> None:
        (latest,) = self._file.execute("SELECT max(number) FROM events").fetchone()
        present = self._file.execute(_PRESENT, {"sure": SURE, "tenth": SURE // 10}).fetchone()
        if latest is None or present is None:
            return
        (now,) = present
        bounds = {
            "sure": latest - SURE,
            "kept": latest - KEPT,
            "month": now - MONTH.total_seconds(),
            "year": now - YEAR.total_seconds(),
        }
        query = f"SELECT max(number) FROM events WHERE {_OLD}"  # noqa: S608  # our own words
        (last,) = self._file.execute(query, bounds).fetchone()
        if last is not None:
            self._set("pruned", str(last))
            self._file.execute(f"DELETE FROM events WHERE {_OLD}", bounds)  # noqa: S608


def kept_events(folder: Path, *, quiet: bool = False) -> EventStore | None:
    """Return a partner's event store; None if it cannot be opened (reported unless ``quiet``)."""
    try:
        return EventStore(folder / "events.sqlite")
    except OutputError as error:
        if not quiet:
            print(f"miburi: {error} Events will be lost when the program ends.", file=sys.stderr)
        return None
