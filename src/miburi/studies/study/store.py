"""Answers in one SQLite file: each is on the disk before the participant sees the next page.

A participant has a number, a place (which sets the order of the films) and a code that only the
participant knows. No name, address or time of day is stored. How long an answer took is stored
unless the study forbids it. When a participant withdraws, only the number stays, and the next
participant gets the place.
"""

import json
import sqlite3
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

from miburi.errors import OutputError
from miburi.studies.study.kept import AnswerPace, Counts, Participant, Shown, StudyAnswer
from miburi.studies.study.live import Ending
from miburi.studies.study.plan import Study

#: The files of answers in a study's folder, from the study and from a rehearsal.
ANSWERS, REHEARSED = "answers.sqlite", "rehearsal.sqlite"
#: The stored ending of a showing after which the robot made another gesture.
_OTHER = "other"

_SCHEMA = """
CREATE TABLE study (digest TEXT NOT NULL, closed INTEGER NOT NULL);
CREATE TABLE wording (digest TEXT NOT NULL, first INTEGER NOT NULL);
CREATE TABLE participant (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    place INTEGER NOT NULL,
    code TEXT UNIQUE,  -- NULL after a withdrawal, "closed" and the number once codes are erased
    language TEXT
);
CREATE TABLE pace (
    participant INTEGER NOT NULL REFERENCES participant,
    step INTEGER NOT NULL,
    seconds REAL,
    plays INTEGER
);
CREATE TABLE showing (
    participant INTEGER NOT NULL REFERENCES participant,
    trial INTEGER NOT NULL,
    film TEXT NOT NULL,
    ending TEXT NOT NULL
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
# Files of earlier versions do not have this table.
_PARTNER = "CREATE TABLE IF NOT EXISTS partner (first INTEGER NOT NULL, facts TEXT NOT NULL)"


class StudyClosedError(OutputError):
    """The study has ended: nobody can begin, answer or withdraw any more."""


@dataclass(frozen=True)
class Store:
    """The answers of a study; open one with :func:`open_store`. Any thread may use it."""

    path: Path
    digest: str  #: of the study
    reading: bool = False  #: the file may not be written, so it is only read

    @property
    def rehearsal(self) -> bool:
        """Whether these are the answers of a rehearsal."""
        return self.path.name == REHEARSED

    def enter(self, code: str, language: str, gone: Collection[int] = ()) -> Participant:
        """Add a participant in the first free place of the order.

        The places of participants who have withdrawn, or are in ``gone``, are free.

        Raises StudyClosedError if the study has ended; OutputError if somebody has opened the file
        with another plan, before anybody began.
        """
        with self._transaction() as database:
            _check_study(database, self)
            if _is_closed(database):
                raise StudyClosedError(f"{self.path}: this study is closed.")
            taken = {
                place
                for number, place in database.execute(
                    "SELECT number, place FROM participant WHERE code IS NOT NULL"
                )
                if number not in gone
            }
            place = next(place for place in count(1) if place not in taken)
            added = database.execute(
                "INSERT INTO participant (place, code, language) VALUES (?, ?, ?)",
                (place, code, language),
            )
            return Participant(int(added.lastrowid or 0), place, language, 0)

    def unfinished(self, steps: int) -> set[int]:
        """Return, by number, the participants who have not answered all ``steps`` pages."""
        rows = self._rows(
            "SELECT number FROM participant WHERE code IS NOT NULL AND NOT EXISTS "
            "(SELECT 1 FROM answer WHERE participant = number AND step = ?)",
            steps - 1,
        )
        return {number for (number,) in rows}

    def find(self, code: str) -> Participant | None:
        """Return the participant with a code, if any."""
        with self._connection() as database:
            return _find(database, code)

    def keep(
        self,
        code: str,
        step: int,
        film: str | None,
        question: str,
        values: Mapping[str, str],
        pace: AnswerPace | None = None,
    ) -> bool:
        """Store an answer by item; return False if it is not for the next page."""
        with self._transaction() as database:
            participant = _find(database, code)
            if participant is None or participant.step != step:
                return False
            database.executemany(
                "INSERT INTO answer VALUES (?, ?, ?, ?, ?, ?)",
                [(participant.number, step, film, question, *pair) for pair in values.items()],
            )
            if pace is not None:
                row = (participant.number, step, pace.seconds, pace.plays)
                database.execute("INSERT INTO pace VALUES (?, ?, ?, ?)", row)
            return True

    def paces(self) -> dict[tuple[int, int], AnswerPace]:
        """Return how long answers took, by participant and step."""
        rows = self._rows("SELECT participant, step, seconds, plays FROM pace")
        return {(number, step): AnswerPace(*pace) for number, step, *pace in rows}

    def wordings(self) -> list[int]:
        """Return the number of the first participant after each change of the study's words.

        The first wording is left out, and so is one that nobody has read.
        """
        with self._connection() as database:
            firsts = [first for (first,) in database.execute("SELECT first FROM wording")]
            last = _last_number(database)
        return sorted({first for first in firsts[1:] if 1 < first <= last})

    def note_partner(self, facts: Mapping[str, object]) -> None:
        """Record the partner that makes live gestures for new participants from now on."""
        text = json.dumps(facts, ensure_ascii=False)
        with self._transaction() as database:
            known = database.execute("SELECT facts FROM partner ORDER BY rowid DESC").fetchone()
            if known != (text,):
                row = (_last_number(database) + 1, text)
                database.execute("INSERT INTO partner VALUES (?, ?)", row)

    def partners(self) -> list[dict[str, object]]:
        """Return each partner that was noted, and the number of the first participant with it."""
        last = dict(self._rows("SELECT first, facts FROM partner ORDER BY rowid"))
        return [{"first_participant": first, **json.loads(last[first])} for first in last]

    def close(self) -> int:
        """End the study: erase all codes, and return their number.

        After that, no answer can be traced to a person by a code, or withdrawn.
        """
        with self._transaction() as database:
            erased = database.execute(
                "UPDATE participant SET code = 'closed ' || number "
                "WHERE code IS NOT NULL AND code NOT LIKE 'closed %'"
            ).rowcount
            database.execute("UPDATE study SET closed = 1")
        self._empty_journal()
        return erased

    @property
    def closed(self) -> bool:
        """Whether the study has ended."""
        with self._connection() as database:
            return _is_closed(database)

    def note_showing(self, code: str, trial: int, film: str, ending: Ending | None) -> None:
        """Record the showing of a live gesture in a trial; None: another gesture came after it."""
        with self._transaction() as database:
            participant = _find(database, code)
            if participant is not None:  # after a withdrawal, nothing is recorded
                row = (participant.number, trial, film, ending.value if ending else _OTHER)
                database.execute("INSERT INTO showing VALUES (?, ?, ?, ?)", row)

    def showings(self) -> dict[tuple[int, int], Shown]:
        """Return how often live gestures were shown, by participant and trial."""
        rows = self._rows(
            "SELECT participant, trial, SUM(ending = ?1), SUM(ending NOT IN (?1, ?2)), "
            "SUM(ending = ?2) FROM showing "
            "GROUP BY participant, trial ORDER BY participant, trial",
            Ending.WHOLE.value, _OTHER,
        )  # fmt: skip
        return {(number, trial): Shown(*counts) for number, trial, *counts in rows}

    def has_seen(self, number: int, trial: int) -> bool:
        """Whether a participant has seen the whole of a trial's live gesture."""
        return bool(
            self._rows(
                "SELECT 1 FROM showing WHERE participant = ? AND trial = ? AND ending = ?",
                number, trial, Ending.WHOLE.value,
            )
        )  # fmt: skip

    def withdraw(self, code: str) -> bool:
        """Delete a participant's answers, language and code; False if nobody has the code."""
        with self._transaction() as database:
            participant = _find(database, code)
            if participant is None:
                return False
            number = (participant.number,)
            for table in ("answer", "showing", "pace"):
                database.execute(f"DELETE FROM {table} WHERE participant = ?", number)  # noqa: S608
            database.execute(
                "UPDATE participant SET code = NULL, language = NULL WHERE number = ?", number
            )
        self._empty_journal()
        return True

    def answers(self) -> list[StudyAnswer]:
        """Return every answer, by participant and page."""
        rows = self._rows(
            "SELECT participant, language, step, film, question, item, value FROM answer "
            "JOIN participant ON participant = number ORDER BY participant, step, item"
        )
        return [StudyAnswer(*row) for row in rows]

    def counts(self, steps: int) -> Counts:
        """Return how many participants began, finished (answered ``steps`` pages) or withdrew."""
        (row,) = self._rows(
            "SELECT COUNT(*), (SELECT COUNT(DISTINCT participant) FROM answer WHERE step = ?), "
            "COUNT(*) - COUNT(code) FROM participant",
            steps - 1,
        )
        return Counts(*row)

    def _rows(self, question: str, *values: int | str) -> list[tuple[Any, ...]]:
        with self._connection() as database:
            return database.execute(question, values).fetchall()

    def _empty_journal(self) -> None:
        with self._connection() as database:
            database.execute("PRAGMA wal_checkpoint(TRUNCATE)")

    @contextmanager
    def _connection(self) -> Iterator[sqlite3.Connection]:
        try:
            database = sqlite3.connect(
                self._address(), timeout=10, isolation_level=None, uri=self.reading
            )
            try:
                database.execute("PRAGMA secure_delete = ON")  # overwrite deleted data
                database.execute("PRAGMA foreign_keys = ON")
                yield database
            finally:
                database.close()
        except sqlite3.Error as error:
            raise OutputError(f"{self.path}: cannot be used: {_in_words(error)}") from error

    def _address(self) -> Path | str:
        if not self.reading:
            return self.path
        journal = Path(f"{self.path}-wal")
        # Without a journal, nothing needs to be written beside the file.
        return f"{self.path.resolve().as_uri()}?{'mode=ro' if journal.exists() else 'immutable=1'}"

    @contextmanager
    def _transaction(self) -> Iterator[sqlite3.Connection]:
        """Commit all changes in the block, or none after an exception."""
        with self._connection() as database:
            database.execute("BEGIN IMMEDIATE")
            yield database
            database.execute("COMMIT")


def open_store(path: Path, study: Study, *, reading: bool = False) -> Store:
    """Open the answers of a study; make the file if there is none.

    As long as nobody has begun, the study may change. With ``reading``, a file that may not be
    written will do.

    Raises OutputError if the file cannot be used, or people have begun with another study.
    """
    store = Store(path, study.digest)
    try:
        _prepare(store, study)
    except OutputError:
        if not reading:
            raise
        store = Store(path, study.digest, reading=True)
        with store._connection() as database:
            _check_study(database, store)
    return store


def _prepare(store: Store, study: Study) -> None:
    """Make the tables that are missing, and record new words."""
    with store._connection() as database:
        database.execute("PRAGMA journal_mode = WAL")
    with store._transaction() as database:
        made = database.execute("SELECT 1 FROM sqlite_master WHERE name = 'study'").fetchone()
        if made is None:
            for statement in _SCHEMA.split(";"):
                database.execute(statement)
            database.execute("INSERT INTO study VALUES (?, 0)", (study.digest,))
        database.execute(_PARTNER)
        # This fails if the file may not be written, even if nothing changes.
        database.execute(
            "UPDATE study SET digest = iif(EXISTS "
            "(SELECT 1 FROM participant WHERE code IS NOT NULL), digest, ?)",
            (study.digest,),
        )
        _check_study(database, store)
        _note_wording(database, study.wording)


def _check_study(database: sqlite3.Connection, store: Store) -> None:
    if database.execute("SELECT digest FROM study").fetchone() != (store.digest,):
        raise OutputError(
            f"{store.path} belongs to another study file. The wording of a study that people have "
            "begun may change, but not films, questions, options, seed or [exclude]. Put the old "
            "file back, or move the answers away to start again."
        )


def _in_words(error: sqlite3.Error) -> str:
    kind = getattr(error, "sqlite_errorcode", 0) & 0xFF  # the rest tells more, and differs
    if kind in (sqlite3.SQLITE_READONLY, sqlite3.SQLITE_CANTOPEN):
        return f"the file or its folder may not be written ({error})."
    return f"{error}. Is the disk full?"


def _note_wording(database: sqlite3.Connection, digest: str) -> None:
    """Record the number of the first participant with a new wording."""
    known = database.execute("SELECT digest FROM wording ORDER BY rowid DESC LIMIT 1").fetchone()
    if known is None or known[0] != digest:
        row = (digest, _last_number(database) + 1)
        database.execute("INSERT INTO wording VALUES (?, ?)", row)


def _last_number(database: sqlite3.Connection) -> int:
    (number,) = database.execute("SELECT COALESCE(MAX(number), 0) FROM participant").fetchone()
    return int(number)


def _is_closed(database: sqlite3.Connection) -> bool:
    return bool(database.execute("SELECT closed FROM study").fetchone()[0])


def _find(database: sqlite3.Connection, code: str) -> Participant | None:
    row = database.execute(
        "SELECT number, place, language, (SELECT COALESCE(MAX(step) + 1, 0) FROM answer "
        "WHERE participant = number) FROM participant WHERE code = ?",
        (code,),
    ).fetchone()
    return None if row is None else Participant(*row)
