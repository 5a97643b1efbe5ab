"""A Stop that only a person may end outlasts the program that it stopped."""

import errno
import os
import threading
from datetime import UTC, datetime
from pathlib import Path

import pytest
from tests.fixtures.live import PATIENT, block, run, until
from tests.fixtures.waiting import until as wait_until

from miburi.errors import BodyError
from miburi.feelings import EmotionalModel, Stimulus
from miburi.live.events.event import LiveEvent
from miburi.live.held import KeptHold
from miburi.live.recording.archive import Archive
from miburi.live.runner import Runner
from miburi.live.wishes import Feel, Release
from miburi.robot import Robot
from miburi.serving.press import By, Press

WHEN = datetime(2026, 11, 24, 10, tzinfo=UTC)


def woken(robot: Robot, folder: Path, body: str = "simulated", *, programs: bool = False) -> Runner:
    """Start a partner that moves at once if it may."""
    path = folder / "stopped.txt"
    hold = KeptHold(path, programs_may_release=programs, now=lambda: WHEN)
    feelings = EmotionalModel()
    runner = Runner(robot, feelings, Archive(folder), body=body, hold=hold, lateness=PATIENT)
    runner.ask(Feel(Stimulus("happiness", 0.9)))
    return runner


def pressed(runner: Runner) -> list[LiveEvent]:
    return [event for event in runner.history.after(0) if event.kind == "pressed"]


def stops(runner: Runner) -> list[str | None]:
    """Return when each reported Stop was pressed, if that was before this start."""
    return [event.detail for event in runner.history.after(0) if event.kind == "stop"]


def press(runner: Runner, by: By) -> None:
    runner.stop(Press(by))
    until(runner, lambda state: state.held)
    run(runner, 0.5)


def release(runner: Runner, *, by_person: bool) -> None:
    released = runner.ask(Release(by_person=by_person))
    run(runner, 0.1)
    released.result(0)


def kill(folder: Path, *, held: bool) -> None:
    """Leave a partner as ``kill -9`` does, once the disk has what it should."""
    path = folder / "stopped.txt"
    wait_until(lambda: path.exists() and bool(path.read_text().strip()) == held)


def wakes_held(runner: Runner) -> bool:
    states = run(runner, 2.0)
    assert len({(state.phase, state.held) for state in states}) == 1 or not states[-1].held
    return states[-1].held


@pytest.mark.parametrize("body", ["simulated", "emulated-card"])
def test_a_killed_partner_wakes_as_a_person_left_it(
    robot: Robot, tmp_path: Path, body: str, firmware: Path
) -> None:
    first = woken(robot, tmp_path, body)
    press(first, "person")
    kill(tmp_path, held=True)
    for _ in range(2):
        again = woken(robot, tmp_path, body)
        assert wakes_held(again)
        state = again.snapshot.state
        assert (state.phase, state.stop and state.stop.reason) == ("stopped", "asked")
        (now,) = pressed(again)
        assert (now.by, now.detail) == ("person", WHEN.isoformat())
        assert stops(again) == [WHEN.isoformat()]
        kill(tmp_path, held=True)
    with pytest.raises(BodyError, match="a person pressed Stop"):
        release(again, by_person=False)
    release(again, by_person=True)
    until(again, lambda state: state.phase == "idle")
    press(again, "program")
    assert stops(again) == [WHEN.isoformat(), None], "a later Stop is another one"
    kill(tmp_path, held=False)
    assert not wakes_held(woken(robot, tmp_path, body))


@pytest.mark.parametrize(
    ("presses", "by"),
    [
        (["home"], "home"),
        (["agent", "person"], "agent"),
        (["program", "ros"], "ros"),
        (["person", "program"], "person"),
        (["program"], None),
        (["partner"], None),
        (["person", None, "program"], None),
        (["person", None, "home"], "home"),
    ],
)
def test_what_only_a_person_may_end_is_remembered(
    robot: Robot, tmp_path: Path, presses: list[By | None], by: By | None
) -> None:
    """None stands for a person's release."""
    first = woken(robot, tmp_path)
    for one in presses:
        if one is None:
            release(first, by_person=True)
        else:
            press(first, one)
    kill(tmp_path, held=by is not None)
    second = woken(robot, tmp_path)
    assert wakes_held(second) == (by is not None)
    assert [event.by for event in pressed(second)] == ([] if by is None else [by])


def test_programs_that_may_release_it_may_after_a_restart(robot: Robot, tmp_path: Path) -> None:
    first = woken(robot, tmp_path)
    press(first, "person")
    first.close(patience=0.0)
    second = woken(robot, tmp_path, programs=True)
    assert wakes_held(second)
    release(second, by_person=False)
    second.close(patience=0.0)
    assert not wakes_held(woken(robot, tmp_path))


@pytest.mark.parametrize("held", [True, False])
def test_of_a_contact_only_a_stop_upon_it_is_remembered(
    robot: Robot, tmp_path: Path, held: bool
) -> None:
    first = woken(robot, tmp_path)
    block(first)
    if held:
        press(first, "person")
    kill(tmp_path, held=held)
    assert wakes_held(woken(robot, tmp_path)) == held


@pytest.mark.parametrize(
    ("text", "by", "when"),
    [
        (b"home 2026-11-24T10:00:00+00:00", "home", WHEN),
        (b"person", "person", None),
        (b"\xffnonsense" * 100, "person", None),
        (b"", "person", None),
        (bytes(64), "person", None),
        (b"home 2026-11-24T10:00" + bytes(43), "person", None),
        (b"nobody" + b" " * 58, "person", None),
    ],
)
def test_whatever_the_file_says_of_a_stop_it_holds(
    tmp_path: Path,
    text: bytes,
    by: By,
    when: datetime | None,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A file that is empty or zeroed does not say that nobody pressed Stop; 64 blanks do."""
    path = tmp_path / "stopped.txt"
    path.write_bytes(text)
    hold = KeptHold(path)
    assert hold.before == (by, when)
    damaged = "stopped.txt is damaged, so the body is stopped until a person releases it"
    assert (damaged in capsys.readouterr().err) == (when is None and text != b"person")
    hold.close()
    hold = KeptHold(path)
    assert hold.before == (by, when)
    hold.end(by_person=True)
    hold.close()  # what still waits to be written must not come after what the next one writes
    assert path.read_bytes() == b" " * 64
    hold = KeptHold(path)
    assert hold.before is None
    hold.close()


def test_a_file_that_cannot_be_read_holds(
    robot: Robot, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "stopped.txt").mkdir()
    runner = woken(robot, tmp_path)
    assert wakes_held(runner)
    runner.close(patience=0.0)
    assert "stopped.txt cannot be read (Is a directory), so the body" in capsys.readouterr().err


def test_the_file_is_never_empty(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A power cut at the first start would leave it so."""
    seen: list[bytes | None] = []
    path, flush = tmp_path / "stopped.txt", os.fsync

    def look(file: int) -> None:
        if Path(f"/proc/self/fd/{file}").readlink().is_relative_to(tmp_path):
            seen.append(path.read_bytes() if path.exists() else None)
        flush(file)

    monkeypatch.setattr(os, "fsync", look)
    hold = KeptHold(path, now=lambda: WHEN)
    hold.press("person")
    hold.close()
    assert [None if each is None else each.strip() for each in seen] == [
        None,
        f"person {WHEN.isoformat()}".encode(),
    ]


def test_no_stop_waits_for_a_disk_and_one_that_takes_nothing_is_told(
    robot: Robot,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    free = threading.Event()

    def slow(_file: int) -> None:
        free.wait()
        raise OSError(errno.EIO, "the disk is broken")

    monkeypatch.setattr(os, "fsync", slow)
    runner = woken(robot, tmp_path)
    press(runner, "person")
    free.set()
    runner.close(patience=0.0)
    told = f"{tmp_path / 'stopped.txt'}: cannot be written (the disk is broken), so a restart"
    assert capsys.readouterr().err.count(told) == 2  # at the start, and at the Stop


def test_without_a_place_it_says_so_and_is_free(
    robot: Robot, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "folder").write_text("a file")
    runner = woken(robot, tmp_path / "folder")
    assert not wakes_held(runner)
    runner.close(patience=0.0)
    assert "so a restart will not know whether somebody pressed Stop" in capsys.readouterr().err
