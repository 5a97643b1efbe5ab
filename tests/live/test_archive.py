"""A disk may be full, slow or gone: the recording ends, says why, and nothing else notices."""

import errno
import io
import threading
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.fixtures.live import run, until

from miburi.errors import InputError, OutputError
from miburi.feelings import Stimulus
from miburi.live.events.event import LiveEvent
from miburi.live.observer import Observer
from miburi.live.recording.archive import Archive
from miburi.live.recording.recorder import read
from miburi.live.runner import STEP, Runner
from miburi.live.wishes import Feel, Release

Choose = Callable[[Callable[[Path], io.RawIOBase]], None]


def no_space() -> None:
    raise OSError(errno.ENOSPC, "No space left on device")


class Disk(io.FileIO):
    """A file that calls one function before each write (with its size), and one when closed."""

    def __init__(
        self,
        path: Path,
        writing: Callable[[int], object] = lambda _: None,
        closing: Callable[[], object] = lambda: None,
    ) -> None:
        super().__init__(path, "wb")
        self.writing, self.closing = writing, closing

    def write(self, data: bytes) -> int:
        self.writing(self.tell() + len(data))
        return super().write(data)

    def close(self) -> None:
        was_open = not self.closed
        super().close()
        if was_open:
            self.closing()


@pytest.fixture
def disk(monkeypatch: pytest.MonkeyPatch) -> Choose:
    """Choose what recordings are written to."""
    really = Path.open

    def choose(make: Callable[[Path], io.RawIOBase]) -> None:
        def open_here(path: Path, mode: str = "r", *more: object, **named: object) -> object:
            if path.suffix == ".mcap" and mode[0] in "wx":
                return io.BufferedWriter(make(path))
            return really(path, mode, *more, **named)

        monkeypatch.setattr(Path, "open", open_here)

    return choose


def ended(runner: Runner) -> LiveEvent:
    """Wait until the recording has ended by itself; return what the log says."""
    run(runner, STEP)
    state = until(runner, lambda state: state.recording is None and state.recording_end, 90.0)
    (entry,) = [entry for entry in runner.history.after(0) if entry.kind == "recording_ended"]
    assert state.recording_end is not None
    assert (state.recording_end.name, state.recording_end.reason) == (entry.name, entry.reason)
    return entry


def stops_and_is_released_once_it_rests(runner: Runner) -> None:
    runner.stop()
    assert run(runner, STEP)[-1].phase == "stopped"
    runner.ask(Release(by_person=True))
    until(runner, lambda state: state.phase == "returning", 1.0)


@pytest.mark.parametrize("room", [0, 30_000])
def test_a_full_disk_ends_the_recording_and_nothing_else(
    runner: Runner, disk: Choose, room: int
) -> None:
    disk(lambda path: Disk(path, writing=lambda size: size > room and no_space()))
    runner.recordings.start()
    runner.ask(Feel(Stimulus("happiness", 0.9)))
    entry = ended(runner)
    assert (entry.name, entry.reason) == ("miburi-0001.mcap", "full")
    assert entry.detail is not None
    assert "No space left" in entry.detail
    stops_and_is_released_once_it_rests(runner)
    # Seconds that fitted are there; a file that not even the first fitted into is not.
    kept = runner.recordings.kept()
    assert [one.whole for one in kept] == ([False] if room == 30_000 else [])
    for one in kept:
        assert len(list(read(runner.recordings.find(one.name), ["/joint_states"]))) >= 50
    runner.close()


def test_a_disk_that_is_full_at_the_end_is_said(runner: Runner, disk: Choose) -> None:
    disk(lambda path: Disk(path, closing=no_space))
    runner.recordings.start()
    run(runner, 0.2)
    runner.recordings.end()
    assert ended(runner).reason == "full"
    stops_and_is_released_once_it_rests(runner)


def test_a_recording_has_not_ended_before_its_file_has(tmp_path: Path, disk: Choose) -> None:
    recordings = Archive(tmp_path)
    names = []  # at the end; without one it could be deleted while it is written
    disk(lambda path: Disk(path, closing=lambda: names.append(recordings.current)))
    recordings.start()
    recordings.end()
    assert names == ["miburi-0001.mcap"]
    assert recordings.current is None
    assert [one.whole for one in recordings.kept()] == [True]


def test_a_slow_disk_holds_up_nothing(
    runner: Runner, disk: Choose, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("miburi.live.recording.archive.WAITING", 60)
    go_on = threading.Event()
    disk(lambda path: Disk(path, writing=lambda _: go_on.wait()))
    runner.recordings.start()
    run(runner, 120 * STEP)
    assert ended(runner).reason == "slow"
    stops_and_is_released_once_it_rests(runner)
    go_on.set()
    (writer,) = [one for one in threading.enumerate() if one.name == "miburi-0001.mcap"]
    writer.join()
    # What it had taken before is whole, and another recording begins.
    assert [kept.whole for kept in runner.recordings.kept()] == [True]
    runner.recordings.start()
    assert run(runner, STEP)[-1].recording_end is None
    runner.close()


def test_what_cannot_be_recorded_ends_the_recording(
    runner: Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object, **_more: object) -> None:
        raise ValueError("no such level")

    runner.recordings.start()
    run(runner, 0.2)
    with monkeypatch.context() as patch:
        patch.setattr("miburi.live.recording.tape.step_messages", fail)
        entry = ended(runner)
    assert (entry.reason, entry.detail) == ("failed", "ValueError: no such level")
    stops_and_is_released_once_it_rests(runner)
    runner.close()
    assert [kept.whole for kept in runner.recordings.kept()] == [True]


def test_an_observer_that_fails_hides_no_stop(
    runner: Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise ValueError("cannot see")

    runner.tick()
    with monkeypatch.context() as patch:
        for name in ("take", "state", "motors"):
            patch.setattr(Observer, name, fail)
        runner.ask(Feel(Stimulus("happiness", 0.9)))
        until(runner, lambda state: state.phase == "moving")
        run(runner, 0.3)  # to be away from neutral
        stops_and_is_released_once_it_rests(runner)
        run(runner, 1.0)
    troubles = [entry.name for entry in runner.history.after(0) if entry.kind == "trouble"]
    assert troubles == ["ValueError: cannot see"]
    assert "stop" in [entry.kind for entry in runner.history.after(0)]
    serial = runner.snapshot.state.serial
    assert run(runner, STEP)[-1].serial == serial + 1


@pytest.mark.parametrize(
    ("largest", "limit", "reason"), [(20_000, 10**9, "size"), (10**9, 20_000, "folder")]
)
def test_a_recording_ends_where_it_may_not_grow(
    runner: Runner, tmp_path: Path, largest: int, limit: int, reason: str
) -> None:
    runner.recordings = Archive(tmp_path / "r", largest=largest, limit=limit)
    runner.recordings.start()
    assert ended(runner).reason == reason
    runner.recordings.end()
    (kept,) = runner.recordings.kept()
    assert kept.whole
    assert kept.bytes < 100_000
    if reason == "size":
        runner.recordings.start()
        assert runner.recordings.current == "miburi-0002.mcap"
        runner.recordings.end()
        return
    with pytest.raises(OutputError, match="delete old ones"):
        runner.recordings.start()
    runner.recordings.delete(kept.name)
    runner.recordings.start()
    runner.recordings.end()


def test_a_name_never_comes_again(tmp_path: Path) -> None:
    for number in range(1, 4):
        recordings = Archive(tmp_path / "r")
        recordings.start()
        name = f"miburi-{number:04d}.mcap"
        assert recordings.current == name
        with pytest.raises(InputError, match="has ended"):
            recordings.delete(name)
        recordings.end()
        recordings.delete(name)
        assert recordings.kept() == []
        with pytest.raises(InputError, match="no recording"):
            recordings.delete(name)
    (tmp_path / "r" / "miburi-10000.mcap").write_bytes(b"")
    (tmp_path / "r" / "miburi-9999.mcap").write_bytes(b"")
    recordings.start()
    names = [kept.name for kept in recordings.kept()]
    assert names == ["miburi-9999.mcap", "miburi-10000.mcap", "miburi-10001.mcap"]
    recordings.end()


def test_a_folder_that_cannot_be_written_to_is_said(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot write there"):
        Archive(tmp_path / "file").start()
