"""Answers in one SQLite file: each is on the disk before the participant sees the next page.

A participant is a number, which names the order of the films, and a code that only the
participant has. No name, address or time is kept. Who withdraws leaves the number alone behind.
"""

import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from miburi.errors import OutputError
from miburi.studies.study.live import Ending
from miburi.studies.study.plan import Study

__all__ = ["Counts", "Participant", "Shown", "Store", "StudyAnswer", "open_store"]

_SCHEMA = """
CREATE TABLE study (digest TEXT NOT NULL);
CREATE TABLE participant (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    code TEXT UNIQUE,  -- NULL: withdrawn
    language TEXT
);
CREATE TABLE answer (
    participant INTEGER NOT NULL REFERENCES participant,
    step INTEGER NOT NULL,
    film TEXT,  -- NULL: about all films
    question TEXT NOT NULL,
    item TEXT NOT NULL,
    value TEXT NOT NULL,
    PRIMARY KEY (participant, step, item)
);
"""
#: Live gestures, whole or broken off; files from before there were any get the table, too.
_LIVE = """
CREATE TABLE IF NOT EXISTS showing (
    participant INTEGER NOT NULL REFERENCES participant,
    trial INTEGER NOT NULL,
    film TEXT NOT NULL,
    ending TEXT NOT NULL
)
"""


@dataclass(frozen=True)
class Participant:
    """Somebody who takes part; ``step`` is the page that comes next, from 0."""

    number: int
    language: str
    step: int


@dataclass(frozen=True)
class StudyAnswer:
    """One value of one answer; ``item`` is empty unless the question is a rating."""

    participant: int
    language: str
    step: int
    film: str | None
    question: str
    item: str
    value: str


@dataclass(frozen=True)
class Shown:
    """How often somebody saw a live gesture: the whole of it, or a part that was broken off."""

    whole: int = 0
    broken: int = 0


@dataclass(frozen=True)
class Counts:
    """How many people began, of these finished, and of all withdrew."""

    began: int
    finished: int
    withdrawn: int


@dataclass(frozen=True)
class Store:
    """The answers of a study; open one with :func:`open_store`. Any thread may use it."""

    path: Path

    def enter(self, code: str, language: str) -> Participant:
        """Add a participant."""
        with self._transaction() as database:
            added = database.execute(
                "INSERT INTO participant (code, language) VALUES (?, ?)", (code, language)
            )
            return Participant(int(added.lastrowid or 0), language, 0)

    def find(self, code: str) -> Participant | None:
        """Return who has a code; None if nobody has, or no longer."""
        with self._connection() as database:
            return _find(database, code)

    def keep(
        self, code: str, step: int, film: str | None, question: str, values: Mapping[str, str]
    ) -> bool:
        """Keep an answer, by item; False if it is not the answer to the page that comes next."""
        with self._transaction() as database:
            participant = _find(database, code)
            if participant is None or participant.step != step:
                return False
            database.executemany(
                "INSERT INTO answer VALUES (?, ?, ?, ?, ?, ?)",
                [(participant.number, step, film, question, *pair) for pair in values.items()],
            )
            return True

    def note_showing(self, code: str, trial: int, film: str, ending: Ending) -> None:
        """Keep that a live gesture was shown, or begun, in a trial."""
        with self._transaction() as database:
            participant = _find(database, code)
            if participant is not None:  # who has withdrawn meanwhile leaves nothing behind
                row = (participant.number, trial, film, ending.value)
                database.execute("INSERT INTO showing VALUES (?, ?, ?, ?)", row)

    def showings(self) -> dict[tuple[int, int], Shown]:
        """Return how often live gestures were shown, by participant and trial."""
        with self._connection() as database:
            rows = database.execute(
                "SELECT participant, trial, SUM(ending = ?), SUM(ending != ?) FROM showing "
                "GROUP BY participant, trial ORDER BY participant, trial",
                (Ending.WHOLE.value, Ending.WHOLE.value),
            )
            return {(number, trial): Shown(*counts) for number, trial, *counts in rows}

    def has_seen(self, number: int, trial: int) -> bool:
        """Whether a participant has seen the whole of a trial's live gesture."""
        with self._connection() as database:
            seen = database.execute(
                "SELECT 1 FROM showing WHERE participant = ? AND trial = ? AND ending = ?",
                (number, trial, Ending.WHOLE.value),
            )
            return seen.fetchone() is not None

    def withdraw(self, code: str) -> bool:
        """Delete a participant's answers, language and code; False if nobody has the code."""
        with self._transaction() as database:
            participant = _find(database, code)
            if participant is None:
                return False
            number = (participant.number,)
            database.execute("DELETE FROM answer WHERE participant = ?", number)
            database.execute("DELETE FROM showing WHERE participant = ?", number)
            database.execute(
                "UPDATE participant SET code = NULL, language = NULL WHERE number = ?", number
            )
        with self._connection() as database:  # what the journal still holds goes, too
            database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        return True

    def answers(self) -> list[StudyAnswer]:
        """Return every answer, by participant and page."""
        with self._connection() as database:
            rows = database.execute(
                "SELECT participant, language, step, film, question, item, value "
                "FROM answer JOIN participant ON participant = number "
                "ORDER BY participant, step, item"
            )
            return [StudyAnswer(*row) for row in rows]

    def counts(self, steps: int) -> Counts:
        """Return how many people there are; those with ``steps`` answered pages have finished."""
        with self._transaction() as database:
            began, kept = database.execute(
                "SELECT COUNT(*), COUNT(code) FROM participant"
            ).fetchone()
            (finished,) = database.execute(
                "SELECT COUNT(DISTINCT participant) FROM answer WHERE step = ?", (steps - 1,)
            ).fetchone()
        return Counts(began, finished, began - kept)

    @contextmanager
    def _connection(self) -> Iterator[sqlite3.Connection]:
        try:
            database = sqlite3.connect(self.path, timeout=10, isolation_level=None)
            try:
                database.execute("PRAGMA secure_delete = ON")  # what is deleted is overwritten
                database.execute("PRAGMA foreign_keys = ON")
                yield database
            finally:
                database.close()
        except sqlite3.Error as error:
            raise OutputError(f"{self.path}: cannot be used: {error}. Is the disk full?") from error

    @contextmanager
    def _transaction(self) -> Iterator[sqlite3.Connection]:
        """All or nothing; what is not committed is rolled back when the connection closes."""
        with self._connection() as database:
            database.execute("BEGIN IMMEDIATE")
            yield database
            database.execute("COMMIT")


def open_store(path: Path, study: Study) -> Store:
    """Open the answers of a study; a new file is made.

    Raises
    ------
    OutputError
        The file cannot be used, or holds the answers to another study.
    """
    store = Store(path)
    with store._connection() as database:
        database.execute("PRAGMA journal_mode = WAL")
    with store._transaction() as database:
        made = database.execute("SELECT 1 FROM sqlite_master WHERE name = 'study'").fetchone()
        if made is None:
            for statement in _SCHEMA.split(";"):
                database.execute(statement)
            database.execute("INSERT INTO study VALUES (?)", (study.digest,))
        database.execute(_LIVE)
        (digest,) = database.execute("SELECT digest FROM study").fetchone()
    if digest != study.digest:
        raise OutputError(
            f"{path} holds the answers to another study file. Put that file back, or move the "
            "answers away to begin anew."
        )
    return store


def _find(database: sqlite3.Connection, code: str) -> Participant | None:
    row = database.execute(
        "SELECT number, language, (SELECT COALESCE(MAX(step) + 1, 0) FROM answer "
        "WHERE participant = number) FROM participant WHERE code = ?",
        (code,),
    ).fetchone()
    return None if row is None else Participant(*row)
