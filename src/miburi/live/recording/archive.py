"""Recordings of a live partner: a folder of numbered MCAP files.

During a recording, the partner's loop hands over each step and never waits: a thread writes the
file. If the disk is full, slow or gone, only the recording ends. The thread flushes every second,
so if the program is killed, the file is readable up to its last second.
"""

import errno
import logging
import queue
import re
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import IO, Literal, NamedTuple

from miburi.errors import InputError, OutputError
from miburi.ground.files import write_whole
from miburi.live.recording.recorder import RecordedMessage, Recorder, RecordingAbout, is_whole
from miburi.live.state import EndReason

_LOG = logging.getLogger(__name__)
#: The largest size of one recording, and of all recordings together, in bytes (our choice).
LARGEST, LIMIT = 500_000_000, 5_000_000_000
#: The most steps that may wait for the disk; they take ten seconds.
WAITING = 500
_STEPS_PER_FLUSH = 50
#: How long to wait at the end of a recording, in s, first until the queue has room, and then as
#: long again for the writing thread.
_PATIENCE = 2.0
_NAME = re.compile(r"miburi-(\d{4,})\.mcap")
#: The file of the latest number, so that a deleted recording's name is not used again.
_NUMBER = ".latest-number"


class News(NamedTuple):
    """A change to the recordings; ``reason`` and ``detail`` say why one ended by itself."""

    kind: Literal["recording", "recorded", "recording_ended", "deleted"]
    name: str
    reason: EndReason | None = None
    detail: str = ""


class Kept(NamedTuple):
    """A recording in the folder; ``whole`` is false until it has ended properly."""

    name: str
    bytes: int
    whole: bool


class Archive:
    """The folder of recordings, and the present recording.

    The partner's loop calls only :meth:`write` and :meth:`news`, which never wait. The other
    methods may wait for the disk, so call them from other threads.

    Parameters
    ----------
    folder
        The folder; it is created with the first recording.
    largest, limit
        The largest size of one recording, and of all recordings together, in bytes.
    """

    def __init__(self, folder: Path, *, largest: int = LARGEST, limit: int = LIMIT) -> None:
        self.limit = limit
        #: Describes the robot and the session of a recording.
        self.describe: Callable[[], RecordingAbout] = RecordingAbout
        #: How the latest recording ended, if it ended by itself; :meth:`news` updates this.
        self.ended: News | None = None
        self._folder = folder
        self._largest = largest
        self._writing: _Writing | None = None
        self._news: queue.SimpleQueue[News] = queue.SimpleQueue()
        self._lock = threading.Lock()  # held while starting, ending and deleting

    @property
    def current(self) -> str | None:
        """The name of the present recording, or None."""
        writing = self._writing
        return None if writing is None or writing.over else writing.name

    def write(self, step: Callable[[], list[RecordedMessage]]) -> None:
        """Record the messages of ``step``, which is called only while recording."""
        writing = self._writing
        if writing is not None and not writing.over:
            writing.take(step)

    def news(self) -> Iterator[News]:
        """Yield the changes among the recordings since the last call."""
        with suppress(queue.Empty):
            while True:
                news = self._news.get_nowait()
                if news.kind in ("recording", "recording_ended"):
                    self.ended = news if news.reason else None
                yield news

    def kept(self) -> list[Kept]:
        """Return all recordings, the oldest first."""
        recordings = []
        for path in self._paths():
            with suppress(OSError), path.open("rb") as file:  # it may have been deleted
                whole = path.name != self.current and is_whole(file)
                recordings.append(Kept(path.name, path.stat().st_size, whole))
        return recordings

    def find(self, name: str) -> Path:
        """Return the file of an ended recording.

        Raises InputError if no ended recording has that name.
        """
        path = self._folder / name
        if not _NAME.fullmatch(name) or name == self.current or not path.is_file():
            raise InputError(f"there is no recording {name[:60]!r} that has ended.")
        return path

    def start(self) -> None:
        """Begin a recording unless one is on.

        Raises OutputError if the folder cannot be written to, or is at its limit.
        """
        with self._lock:
            if self.current is not None:
                return
            try:
                self._folder.mkdir(parents=True, exist_ok=True)
                room = self.limit - sum(path.stat().st_size for path in self._paths())
                if room <= 0:
                    raise OutputError(
                        f"{self._folder}: the recordings have reached their limit of "
                        f"{self.limit / 1e6:g} MB together; delete old ones."
                    )
                path, file = self._new_file()
            except OSError as error:
                raise OutputError(f"{self._folder}: cannot write there: {error}.") from error
            reason = EndReason.SIZE if self._largest <= room else EndReason.FOLDER
            self._news.put(News("recording", path.name))
            largest = min(self._largest, room)
            about = self.describe()
            self._writing = _Writing(path, file, about, largest, reason, self._news.put)

    def end(self) -> None:
        """Finish the present recording, if there is one."""
        with self._lock:
            if self._writing is not None:
                self._writing.end()
                self._writing = None

    def delete(self, name: str) -> None:
        """Delete an ended recording.

        Raises InputError if no ended recording has that name; OutputError if the folder cannot be
        written to.
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
        paths = [path for path in self._folder.iterdir() if _NAME.fullmatch(path.name)]
        return sorted(paths, key=_number_of)

    def _new_file(self) -> tuple[Path, IO[bytes]]:
        """Open a file under a number that no recording has had."""
        latest, marker = 0, self._folder / _NUMBER
        with suppress(OSError, ValueError):
            latest = int(marker.read_text(encoding="ascii"))
        number = max([latest, *map(_number_of, self._paths())])
        while True:
            number += 1
            path = self._folder / f"miburi-{number:04d}.mcap"
            write_whole(marker, str(number))
            with suppress(FileExistsError):  # another program records here too
                return path, path.open("xb")


def _number_of(path: Path) -> int:
    return int(path.stem.removeprefix("miburi-"))


class _Writing:
    """A recording in progress, and its writing thread."""

    def __init__(
        self,
        path: Path,
        file: IO[bytes],
        about: RecordingAbout,
        largest: int,
        at_largest: EndReason,
        tell: Callable[[News], None],
    ) -> None:
        self.name = path.name
        self.over = False
        self._ending = False
        self._path, self._file, self._about = path, file, about
        self._largest, self._at_largest = largest, at_largest
        self._tell = tell
        self._steps: queue.Queue[list[RecordedMessage] | None] = queue.Queue(WAITING)
        self._once = threading.Lock()
        self._thread = threading.Thread(target=self._run, name=self.name, daemon=True)
        self._thread.start()

    def take(self, step: Callable[[], list[RecordedMessage]]) -> None:
        if self._ending:
            return
        try:
            self._steps.put_nowait(step())
        except queue.Full:
            self._close(EndReason.SLOW)
        except Exception as error:  # any failure concerns only the recording
            _LOG.exception("a step cannot be recorded")
            self._close(EndReason.FAILED, f"{type(error).__name__}: {error}")

    def end(self) -> None:
        self._ending = True
        with suppress(queue.Full):
            self._steps.put(None, timeout=_PATIENCE)
        self._thread.join(_PATIENCE)
        if self._thread.is_alive():
            self._close(EndReason.SLOW)

    def _close(self, reason: EndReason | None, detail: str = "") -> None:
        """End the recording; only the first reason is reported."""
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
            with self._file, Recorder(self._file, self._about) as recorder:
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
            _LOG.exception("the recording has failed")
            self._close(EndReason.FAILED, f"{type(error).__name__}: {error}")
        self._close(None)
