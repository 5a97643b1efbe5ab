"""Recordings of a live partner: numbered MCAP files, whole under their final names."""

import re
from pathlib import Path
from typing import IO

from miburi.bodies import BodyState
from miburi.errors import InputError, OutputError
from miburi.feelings import FeelingModel
from miburi.partner import Event
from miburi.recording import Recorder

_NAME = re.compile(r"miburi-(\d{4})\.mcap")
#: A recording ends by itself at this size, bytes.
LARGEST = 500_000_000


class Recordings:
    """The folder of recordings, and the one that is being written.

    Only the runner's thread starts, writes and ends; any thread may list and find.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._file: IO[bytes] | None = None
        self._recorder: Recorder | None = None
        self._current: str | None = None

    @property
    def current(self) -> str | None:
        """The name of the recording that is being written, or None."""
        return self._current

    def names(self) -> list[str]:
        """Return the recordings that are whole, the oldest first."""
        if not self._folder.is_dir():
            return []
        return sorted(file.name for file in self._folder.iterdir() if _NAME.fullmatch(file.name))

    def find(self, name: str) -> Path:
        """Return the file of a whole recording.

        Raises
        ------
        InputError
            There is none of that name.
        """
        if name not in self.names():
            raise InputError(f"there is no recording {name[:60]!r}.")
        return self._folder / name

    def start(self) -> str:
        """Begin a recording unless one is being written; return its name.

        Raises
        ------
        OutputError
            The folder cannot be written to.
        """
        if self._current is None:
            numbers = [int(name[7:11]) for name in self.names()]
            name = f"miburi-{max(numbers, default=0) + 1:04d}.mcap"
            try:
                self._folder.mkdir(parents=True, exist_ok=True)
                self._file = (self._folder / f".{name}").open("wb")
            except OSError as error:
                raise OutputError(f"{self._folder}: cannot write there: {error}.") from error
            self._recorder, self._current = Recorder(self._file), name
        return self._current

    def write(
        self, state: BodyState, feelings: FeelingModel, events: list[Event], with_feelings: bool
    ) -> None:
        """Record one step; does nothing while no recording is on."""
        if self._recorder is None or self._file is None:
            return
        self._recorder.state(state)
        if with_feelings:
            self._recorder.feelings(state.time, feelings)
        for event in events:
            self._recorder.event(event)
        if self._file.tell() > LARGEST:
            self.end()

    def end(self) -> None:
        """Finish the recording that is being written, if there is one."""
        if self._recorder is None or self._file is None or self._current is None:
            return
        name, self._current = self._current, None
        recorder, self._recorder = self._recorder, None
        with self._file, recorder:
            pass
        (self._folder / f".{name}").replace(self._folder / name)
        self._file = None
