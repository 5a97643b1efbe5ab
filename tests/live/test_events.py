"""Events outlast the partner: cursors over restarts, gaps, words that are forgotten."""

import itertools
import sqlite3
import threading
from collections.abc import Iterator
from contextlib import closing
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import get_args

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.fixtures.live import run
from tests.fixtures.waiting import PATIENCE
from tests.fixtures.waiting import until as until_true

from miburi.errors import InputError, OutputError
from miburi.feelings import EmotionalModel
from miburi.live.events.event import Cursor, LiveEvent, without_words
from miburi.live.events.log import Log
from miburi.live.events.store import EventStore, kept_events
from miburi.live.recording.archive import Archive
from miburi.live.recording.recorder import read
from miburi.live.runner import Runner
from miburi.live.stage import Act
from miburi.live.wishes import (
    AllowWords,
    PerformActs,
    Sense,
    Speak,
)
from miburi.robot import Robot
from miburi.senses import Brought
from miburi.senses.words import hear
from miburi.serving.press import By

BEGAN = datetime(2026, 11, 24, 10, tzinfo=UTC)
#: How many events are kept in memory here, and how many are kept whatever the clock says.
FEW, SURE = 60, 50


@pytest.fixture(scope="module", autouse=True)
def few() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("miburi.live.events.log.LOGGED", FEW)
        patch.setattr("miburi.live.events.store.SURE", SURE)
        yield


def kept(folder: Path, days: float = 0.0) -> Log:
    """Return the log of a start of the partner, so many days after the first."""
    return Log(EventStore(folder / "events.sqlite"), now=lambda: BEGAN + timedelta(days=days))


def woken(robot: Robot, folder: Path) -> Runner:
    return Runner(robot, EmotionalModel(), Archive(folder), events=kept_events(folder))


def heard(log: Log, cursor: Cursor) -> list[str]:
    return [event.name or event.kind for event in log.history.since(cursor, 10_000)]


def test_what_a_killed_partner_had_told_and_not_written_hides_nothing_new(tmp_path: Path) -> None:
    """Its last number is given again; a cursor of the old start must not take it for known."""
    first = kept(tmp_path)
    first.note(1.0, "stop", name="written")
    first.close()
    told = first.history.number + 1
    second = kept(tmp_path)
    assert second.note(1.0, "stop", name="new").number == told
    assert heard(second, Cursor(first.history.boot, told)) == ["gap", "new"]


@pytest.mark.parametrize("stored", [True, False])
def test_a_cursor_that_was_never_given_is_a_gap_and_then_follows_on(
    tmp_path: Path, stored: bool
) -> None:
    log = kept(tmp_path) if stored else Log()
    last = log.note(1.0, "paused")
    (gap,) = log.history.since(Cursor(last.boot, 99_999), 10)
    assert (gap.kind, gap.id) == ("gap", last.id)
    assert gap.detail
    assert heard(log, gap.cursor) == []
    log.note(2.0, "resumed")
    assert heard(log, gap.cursor) == ["resumed"]


@settings(max_examples=30)
@given(st.lists(st.integers(0, 90), min_size=1, max_size=4), st.data())
def test_whoever_asks_from_event_to_event_hears_each_once(
    tmp_path_factory: pytest.TempPathFactory, starts: list[int], data: st.DataObject
) -> None:
    folder = tmp_path_factory.mktemp("events")
    cursor, names, got = Cursor(None, 0), itertools.count(), []
    for count in starts:
        log = kept(folder)
        for _ in range(count):
            log.note(0.0, "refused", name=str(next(names)))
        log.close()
        if data.draw(st.booleans()):
            while told := log.history.since(cursor, data.draw(st.integers(1, 50))):
                got += [int(event.name or -1) for event in told]
                cursor = told[-1].cursor
    last = kept(folder)
    while told := last.history.since(cursor, 100):
        got += [int(event.name or -1) for event in told]
        cursor = told[-1].cursor
    last.close()
    assert got == list(range(next(names)))


def test_a_cursor_of_another_folder_hears_that_it_is_unknown_and_then_all(tmp_path: Path) -> None:
    other, log = kept(tmp_path / "other"), kept(tmp_path)
    cursor = other.note(1.0, "stop").cursor
    known = log.note(1.0, "stop", name="ours")
    assert heard(log, cursor) == ["gap", "ours"]
    assert heard(log, Cursor(None, 99)) == ["gap", "ours"], "a number that was never given"
    assert heard(log, Cursor(None, known.number - 1)) == ["ours"], "a bare number"


def test_what_is_too_old_is_left_out_and_said_to_be_and_stops_stay(tmp_path: Path) -> None:
    log = kept(tmp_path)
    log.note(0.0, "stop", name="old stop")
    for number in range(4 * SURE):
        log.note(0.0, "refused", name=f"old {number}")
    log.close()
    later = kept(tmp_path, days=31)
    for number in range(3 * SURE):
        later.note(0.0, "refused", name=f"new {number}")
    later.close()
    told = heard(kept(tmp_path), Cursor(None, 0))
    assert told[:2] == ["gap", "old stop"]
    assert told[-3 * SURE :] == [f"new {number}" for number in range(3 * SURE)]
    assert "old 0" not in told


def test_a_clock_that_jumps_takes_nothing_away(tmp_path: Path) -> None:
    """A small computer wakes in 1970, and learns the time later."""
    log = kept(tmp_path, days=-20_000)
    log.note(0.0, "gesture_begun", name="in 1970")
    log.close()
    kept(tmp_path).close()
    assert heard(kept(tmp_path), Cursor(None, 0)) == ["in 1970"]


def test_one_wrong_time_far_ahead_takes_nothing_away(tmp_path: Path) -> None:
    log = kept(tmp_path)
    log.note(0.0, "stop", name="stop")
    for number in range(SURE):
        log.note(0.0, "refused", name=f"old {number}")
    log.close()
    ahead = kept(tmp_path, days=5000)
    ahead.note(0.0, "paused")
    ahead.close()
    later = kept(tmp_path)
    for number in range(SURE):
        later.note(0.0, "refused", name=f"new {number}")
    later.close()
    told = heard(kept(tmp_path), Cursor(None, 0))
    assert told[:2] == ["stop", "old 0"]


def test_events_that_a_full_disk_did_not_take_are_a_gap(tmp_path: Path) -> None:
    log = kept(tmp_path)
    cursor = log.note(0.0, "stop").cursor
    log.close()
    with closing(sqlite3.connect(tmp_path / "events.sqlite")) as file, file:
        log = kept(tmp_path)
        for number in range(2 * FEW):
            log.note(0.0, "refused", name=str(number))
        log.close()
        file.execute("DELETE FROM events WHERE number BETWEEN 10 AND 20")
    told = log.history.since(cursor, 10_000)
    (gap,) = [event for event in told if event.kind == "gap"]
    assert told[told.index(gap) + 1].number == gap.number + 1 == 21
    assert len(told) == 2 * FEW - 11 + 1


def test_an_event_of_another_version_hides_no_other(tmp_path: Path) -> None:
    log = kept(tmp_path)
    for number in range(3 * FEW):
        log.note(0.0, "refused", name=str(number))
    log.close()
    with closing(sqlite3.connect(tmp_path / "events.sqlite")) as file, file:
        file.execute(
            "UPDATE events SET content = replace(content, 'refused', 'x') WHERE number = 3"
        )
    told, cursor = [], Cursor(None, 0)
    while events := log.history.since(cursor, FEW):
        told += [event.name or event.kind for event in events]
        cursor = events[-1].cursor
    assert told == ["0", "1", "gap", *map(str, range(3, 3 * FEW))]


def test_events_that_the_file_does_not_take_at_first_are_written_later(tmp_path: Path) -> None:
    log = kept(tmp_path)
    with pytest.MonkeyPatch.context() as patch:
        tried = threading.Event()

        def locked(_store: EventStore, _events: object) -> None:
            tried.set()
            raise sqlite3.OperationalError("database is locked")

        patch.setattr(EventStore, "write", locked)
        log.note(0.0, "stop", name="while it is locked")
        assert tried.wait(PATIENCE)
    log.note(0.0, "paused")
    log.close()
    assert heard(kept(tmp_path), Cursor(None, 0)) == ["while it is locked", "paused"]


@pytest.mark.parametrize("write", ["forget_words", "set_note"])
def test_words_are_kept_or_forgotten_as_it_says_even_if_the_disk_is_full(
    tmp_path: Path, write: str
) -> None:
    def full(*_: object) -> None:
        raise sqlite3.OperationalError("database or disk is full")

    log = kept(tmp_path)
    log.allow_words(True)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(EventStore, write, full)
        with pytest.raises(OutputError, match="disk is full. Make room"):
            log.allow_words(False)
        assert log.words
    log.close()
    again = kept(tmp_path)
    assert again.words
    again.allow_words(False)
    assert not kept(tmp_path).words


def test_what_somebody_in_distress_said_is_forgotten_wherever_it_was(runner: Runner) -> None:
    runner.ask(AllowWords(True))
    run(runner, 0.1)
    said = "I fell in the larder"
    runner.ask(Sense(hear(said), said))
    run(runner, 0.1)
    distress = runner.snapshot.state.distress
    assert distress is not None
    assert distress.words == said
    runner.ask(AllowWords(False))
    run(runner, 0.1)
    assert runner.snapshot.state.distress == distress.model_copy(update={"words": None})
    assert [event.text for event in runner.history.after(0) if event.text] == []


def copied(folder: Path) -> int:
    """Return how many events a copy of the file alone has, without what is beside it."""
    (copy := folder / "copy").mkdir(exist_ok=True)
    (copy / "events.sqlite").write_bytes((folder / "events.sqlite").read_bytes())
    with closing(sqlite3.connect(copy / "events.sqlite")) as file:
        (count,) = file.execute("SELECT count(*) FROM events").fetchone()
    return int(count)


def test_a_copy_of_the_file_alone_lacks_few_events_and_none_after_a_while(tmp_path: Path) -> None:
    """It was empty: all was in the -wal beside it."""
    store = EventStore(tmp_path / "events.sqlite")
    same = {"boot": "5f2c9a10", "wall": BEGAN, "time": 0.0, "kind": "stop"}
    for number in range(1, 201):
        store.write([LiveEvent.model_validate({**same, "number": number})])
    assert copied(tmp_path) > 150
    log = kept(tmp_path)
    log.note(0.0, "paused")
    until_true(lambda: copied(tmp_path) == 201)
    log.close()


def test_a_damaged_file_is_put_aside_until_words_are_forgotten(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = kept(tmp_path)
    for number in range(10 * SURE):
        log.note(0.0, "refused", name=str(number))
    log.close()
    with closing(sqlite3.connect(tmp_path / "events.sqlite")) as file:
        file.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    whole = (tmp_path / "events.sqlite").read_bytes()
    (tmp_path / "events.sqlite").write_bytes(whole[:4096] + bytes(len(whole) - 4096))
    log = kept(tmp_path)
    log.note(0.0, "stop", name="new")
    assert "kept as events.sqlite.bad" in capsys.readouterr().err
    assert heard(log, Cursor(None, 0)) == ["new"]
    log.close()
    (tmp_path / "events.sqlite").write_text("nonsense " * 1000)
    log = kept(tmp_path)
    aside = sorted(tmp_path.glob("*.bad*"))
    assert [path.name for path in aside] == ["events.sqlite.bad", "events.sqlite.bad-2"]
    log.allow_words(False)
    assert [*tmp_path.glob("*.bad*")] == []


def test_a_file_that_cannot_be_written_leaves_the_partner_without_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise sqlite3.OperationalError("database or disk is full")

    monkeypatch.setattr(EventStore, "begin", full)
    log = kept(tmp_path)
    assert "disk is full. Events will be lost" in capsys.readouterr().err
    log.note(0.0, "stop", name="here")
    assert heard(log, Cursor(None, 0)) == ["here"]
    log.allow_words(True)
    assert log.words


def test_a_file_that_is_none_of_ours_is_put_aside(tmp_path: Path) -> None:
    (tmp_path / "events.sqlite").write_text("nonsense " * 1000)
    log = kept(tmp_path)
    log.note(0.0, "stop", name="new")
    log.close()
    assert heard(kept(tmp_path), Cursor(None, 0)) == ["new"]
    assert (tmp_path / "events.sqlite.bad").read_text().startswith("nonsense")


def test_without_a_place_it_lives_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "folder").write_text("a file")
    assert kept_events(tmp_path / "folder") is None
    assert "events cannot be kept there" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["", "x", "5f2c9a10:", ":1", "5F2C9A10:1", "-1", "1 1"])
def test_what_names_no_event_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="BOOT:NUMBER"):
        Cursor.of(text)


def test_no_byte_of_what_was_said_is_kept_unless_allowed_and_none_after(
    robot: Robot, tmp_path: Path
) -> None:
    def said(runner: Runner, text: str) -> None:
        runner.ask(Sense(hear(text), text))
        run(runner, 0.1)

    def kept_bytes() -> bytes:
        return b"".join(path.read_bytes() for path in tmp_path.glob("events.sqlite*"))

    runner = woken(robot, tmp_path)
    said(runner, "I am so sad, my marmalade is mouldy")
    runner.ask(AllowWords(True))
    run(runner, 0.1)
    assert b"marmalade" not in kept_bytes()
    assert b"mouldy" not in kept_bytes()
    said(runner, "I am so sad, my hyacinth is dead")
    runner.close(patience=0.0)
    assert b"hyacinth" in kept_bytes()
    runner = woken(robot, tmp_path)
    assert runner.snapshot.state.words, "the switch is as it was"
    said(runner, "I fell in the larder")
    runner.ask(AllowWords(False))
    run(runner, 0.1)
    runner.close(patience=0.0)
    for word in (b"hyacinth", b"larder"):
        assert word not in kept_bytes()
    kinds = [e.kind for e in kept(tmp_path).history.since(Cursor(None, 0), 1000)]
    assert kinds.count("heard") == 3, "that something was said stays"


def test_an_answer_that_may_repeat_them_is_kept_no_longer_than_they_are(
    robot: Robot, tmp_path: Path
) -> None:
    runner = woken(robot, tmp_path)
    for text, by in (("You said: under the flowerpot.", "partner"), ("Tea!", "program")):
        runner.ask(Speak(text, by))
        run(runner, 0.1)
    runner.ask(AllowWords(True))
    runner.ask(Speak("You said: at the neighbour's.", "partner"))
    run(runner, 0.1)
    runner.close(patience=0.0)

    def texts() -> list[str | None]:
        events = kept(tmp_path).history.since(Cursor(None, 0), 1000)
        return [event.text for event in events if event.kind == "speech_begun"]

    assert texts() == [None, "Tea!", "You said: at the neighbour's."]
    runner = woken(robot, tmp_path)
    runner.ask(AllowWords(False))
    run(runner, 0.1)
    runner.close(patience=0.0)
    assert texts() == [None, "Tea!", None]


@pytest.mark.parametrize("allowed", [False, True])
def test_no_byte_of_an_answer_is_left_by_its_end(
    robot: Robot, tmp_path: Path, *, allowed: bool
) -> None:
    """The end of a sentence repeated it. Words were never allowed, or are no longer."""
    runner = woken(robot, tmp_path)
    runner.ask(AllowWords(allowed))
    runner.recordings.start()
    for text, by, seconds in (
        ("Noted: the tumour is back.", "partner", 0.1),
        ("Noted: your tumour is back.", "partner", 5.0),
        ("Tea!", "program", 3.0),
    ):
        runner.ask(Speak(text, by))
        run(runner, seconds)
    runner.ask(PerformActs([Act(0.0, words="Cake!")], queued=False, by="program"))
    run(runner, 5.0)
    if allowed:
        runner.ask(AllowWords(False))
        run(runner, 0.1)
    runner.close(patience=0.0)
    told = kept(tmp_path).history.since(Cursor(None, 0), 1000)
    now = [*map(without_words, runner.history.after(0))]
    (recording,) = tmp_path.glob("*.mcap")
    taped = [
        LiveEvent.model_validate({**message.content, "time": message.time})
        for message in read(recording, ["/events"])
    ]
    for events in (told, now, taped):
        ends = [e.kind for e in events if e.kind in ("speech_ended", "speech_broken_off")]
        assert ends == ["speech_broken_off", *["speech_ended"] * 3]
        assert [e.text for e in events if e.text] == ["Tea!"] * 2 + ["Cake!"] * 2
    everything = [path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()]
    assert [file for file in everything if b"tumour" in file] == []


def test_what_an_earlier_version_left_is_forgotten_at_the_next_start(tmp_path: Path) -> None:
    """It kept the text of an answer with its end."""
    store = EventStore(tmp_path / "events.sqlite")
    left = {"boot": "5f2c9a10", "number": 1, "wall": BEGAN, "time": 0.0, "kind": "speech_ended"}
    store.write([LiveEvent.model_validate({**left, "text": "The tumour is back."})])
    store.close()
    kept(tmp_path).close()
    everything = [path.read_bytes() for path in tmp_path.iterdir()]
    assert [file for file in everything if b"tumour" in file] == []


def test_what_is_forgotten_on_the_disk_is_what_is_hidden(tmp_path: Path) -> None:
    store, said = EventStore(tmp_path / "events.sqlite"), (Brought("said", 1.0),)
    kinds = get_args(LiveEvent.model_fields["kind"].annotation)
    causes = itertools.product(kinds, [None, *get_args(By)], [None, "speech", "touch"])
    same = {"boot": "5f2c9a10", "wall": BEGAN, "time": 0.0, "text": "said", "detail": "said"}
    events = [
        LiveEvent.model_validate(
            {**same, "number": number, "kind": kind, "by": by, "source": source, "why": said}
        )
        for number, (kind, by, source) in enumerate(causes, 1)
    ]
    store.write(events)
    store.forget_words()
    assert store.read(0, len(events)) == [without_words(event) for event in events]
