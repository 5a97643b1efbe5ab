"""Recordings of a live partner: numbered MCAP files, each written by a thread of its own.

The loop hands its steps over and goes on. A disk that is full, slow or gone ends the recording,
and nothing else. Each second is handed to the system when it has passed: a program that is killed
leaves a file that can be read up to there.
"""

import errno
import queue
import re
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from enum import StrEnum
from pathlib import Path
from typing import IO, Literal, NamedTuple

from miburi.errors import InputError, OutputError
from miburi.ground.files import write_whole
from miburi.live.recording import Message, Recorder, is_whole

__all__ = ["LARGEST", "LIMIT", "WAITING", "EndReason", "Kept", "News", "Recordings"]

#: The largest recording, and the most that all of them may take together, bytes (ours).
LARGEST, LIMIT = 500_000_000, 5_000_000_000
#: Steps that may wait for the disk: ten seconds.
WAITING = 500
_STEPS_PER_FLUSH = 50
#: s that the end of a recording waits for the disk, and again for its thread.
_PATIENCE = 2.0
_NAME = re.compile(r"miburi-(\d{4,})\.mcap")
#: Keeps the latest number, so that no name comes again after its file was deleted.
_NUMBER = ".latest-number"


class EndReason(StrEnum):
    """Why a recording ended by itself; its words are the languages'."""

    FULL = "full"
    SLOW = "slow"
    SIZE = "size"
    FOLDER = "folder"
    FAILED = "failed"


class News(NamedTuple):
    """What became of a recording.

    Attributes
    ----------
    kind
        It began, it was ended, it ended by itself, or it was deleted.
    name
        Its file's.
    reason, detail
        Why it ended by itself, and what the system said.
    """

    kind: Literal["recording", "recorded", "recording_ended", "deleted"]
    name: str
    reason: EndReason | None = None
    detail: str = ""


class Kept(NamedTuple):
    """A recording in the folder; it is not whole while it is written, or if it was broken off."""

    name: str
    bytes: int
    whole: bool


class Recordings:
    """The folder of recordings, and the one that is being written.

    The loop calls :meth:`write` and :meth:`news`, which never wait. Everything else may wait for
    the disk, and is for other threads.

    Parameters
    ----------
    folder
        Made when the first recording starts.
    largest, limit
        The largest recording, and the most that all of them may take together, bytes.
    """

    def __init__(self, folder: Path, *, largest: int = LARGEST, limit: int = LIMIT) -> None:
        self.limit = limit
        self._folder = folder
        self._largest = largest
        self._writing: _Writing | None = None
        self._news: queue.SimpleQueue[News] = queue.SimpleQueue()
        self._lock = threading.Lock()  # for who starts, ends and deletes

    @property
    def current(self) -> str | None:
        """The name of the recording that is being written, or None."""
        writing = self._writing
        return None if writing is None or writing.over else writing.name

    def write(self, step: Callable[[], list[Message]]) -> None:
        """Record what ``step`` returns; it is not called while no recording is on."""
        writing = self._writing
        if writing is not None and not writing.over:
            writing.take(step)

    def news(self) -> Iterator[News]:
        """Yield what became of recordings since the last call."""
        with suppress(queue.Empty):
            while True:
                yield self._news.get_nowait()

    def kept(self) -> list[Kept]:
        """Return all recordings, the oldest first."""
        found = []
        for path in self._paths():
            with suppress(OSError), path.open("rb") as file:  # it may have gone meanwhile
                whole = path.name != self.current and is_whole(file)
                found.append(Kept(path.name, path.stat().st_size, whole))
        return found

    def find(self, name: str) -> Path:
        """Return the file of a recording that has ended.

        Raises
        ------
        InputError
            There is none of that name.
        """
        path = self._folder / name
        if not _NAME.fullmatch(name) or name == self.current or not path.is_file():
            raise InputError(f"there is no recording {name[:60]!r} that has ended.")
        return path

    def start(self) -> None:
        """Begin a recording unless one is being written.

        Raises
        ------
        OutputError
            The folder cannot be written to, or holds as much as it may.
        """
        with self._lock:
            if self.current is not None:
                return
            try:
                self._folder.mkdir(parents=True, exist_ok=True)
                room = self.limit - sum(path.stat().st_size for path in self._paths())
                if room <= 0:
                    raise OutputError(
                        f"{self._folder}: the recordings take {self.limit / 1e6:g} MB together, "
                        "which is all that they may; delete old ones."
                    )
                path, file = self._new_file()
            except OSError as error:
                raise OutputError(f"{self._folder}: cannot write there: {error}.") from error
            reason = EndReason.SIZE if self._largest <= room else EndReason.FOLDER
            self._news.put(News("recording", path.name))
            largest = min(self._largest, room)
            self._writing = _Writing(path, file, largest, reason, self._news.put)

    def end(self) -> None:
        """Finish the recording that is being written, if there is one."""
        with self._lock:
            writing, self._writing = self._writing, None
            if writing is not None:
                writing.end()

    def delete(self, name: str) -> None:
        """Delete a recording that has ended.

        Raises
        ------
        InputError
            There is none of that name.
        OutputError
            The folder cannot be written to.
        """
        with self._lock:
            path = self.find(name)
            try:
                path.unlink(missing_ok=True)
            except OSError as error:
                raise OutputError(f"{path}: cannot be deleted: {error.strerror}.") from error
        self._news.put(News("deleted", name))

    def _paths(self) -> list[Path]:
        if not self._folder.is_dir():
            return []
        found = [path for path in self._folder.iterdir() if _NAME.fullmatch(path.name)]
        return sorted(found, key=_number_of)

    def _new_file(self) -> tuple[Path, IO[bytes]]:
        """Open a file under a number that no recording has had."""
        latest, marker = 0, self._folder / _NUMBER
        with suppress(OSError, ValueError):
            latest = int(marker.read_text())
        number = max([latest, *map(_number_of, self._paths())])
        while True:
            number += 1
            path = self._folder / f"miburi-{number:04d}.mcap"
            write_whole(marker, str(number))
            with suppress(FileExistsError):  # another program records here, too
                return path, path.open("xb")


def _number_of(path: Path) -> int:
    return int(path.stem.removeprefix("miburi-"))


class _Writing:
    """One recording, and the thread that writes it."""

    def __init__(
        self,
        path: Path,
        file: IO[bytes],
        largest: int,
        at_largest: EndReason,
        tell: Callable[[News], None],
    ) -> None:
        self.name = path.name
        self.over = False
        self._path, self._file = path, file
        self._largest, self._at_largest = largest, at_largest
        self._tell = tell
        self._steps: queue.Queue[list[Message] | None] = queue.Queue(WAITING)
        self._once = threading.Lock()
        self._thread = threading.Thread(target=self._run, name=self.name, daemon=True)
        self._thread.start()

    def take(self, step: Callable[[], list[Message]]) -> None:
        """Let a step wait for its turn."""
        try:
            self._steps.put_nowait(step())
        except queue.Full:
            self._close(EndReason.SLOW)
        except Exception as error:  # whatever it is, it is the recording's matter alone
            self._close(EndReason.FAILED, f"{type(error).__name__}: {error}")

    def end(self) -> None:
        """Write what is waiting, and finish the file."""
        with suppress(queue.Full):
            self._steps.put(None, timeout=_PATIENCE)
        self._thread.join(_PATIENCE)
        if self._thread.is_alive():
            self._close(EndReason.SLOW)

    def _close(self, reason: EndReason | None, detail: str = "") -> None:
        """Take no more steps, and tell why; only the first reason counts."""
        with self._once:
            if self.over:
                return
            self.over = True
        self._tell(News("recording_ended" if reason else "recorded", self.name, reason, detail))
        with suppress(queue.Full):
            self._steps.put_nowait(None)  # the thread may be waiting for a step

    def _run(self) -> None:
        readable = False
        try:
            with self._file, Recorder(self._file) as recorder:
                for count, messages in enumerate(iter(self._steps.get, None), start=1):
                    recorder.write(messages)
                    if count % _STEPS_PER_FLUSH == 0:
                        recorder.flush()
                        readable = True
                        if self._file.tell() > self._largest:
                            self._close(self._at_largest)
                    if self.over:
                        break
        except OSError as error:
            if not readable:
                with suppress(OSError):
                    self._path.unlink()
            full = error.errno in (errno.ENOSPC, errno.EDQUOT)
            self._close(EndReason.FULL if full else EndReason.FAILED, error.strerror or str(error))
        except Exception as error:
            self._close(EndReason.FAILED, f"{type(error).__name__}: {error}")
        self._close(None)
