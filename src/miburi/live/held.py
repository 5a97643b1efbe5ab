"""A file that keeps a person's Stop over restarts, until a person releases the body.

A thread writes it, so no Stop waits for the disk; once it is written, a power cut does not lose the
Stop. The file has its full length from the start and is changed in place, so it can be written even
on a full disk. Only blanks, or no file, say that nobody pressed Stop. A file that cannot be read or
understood counts as a person's Stop; so does an empty one, since Miburi never leaves the file so.
"""

import os
import sys
import threading
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from queue import SimpleQueue

from miburi.ground.files import write_whole
from miburi.serving.press import By, Hold, who

#: Bytes in the file: a name and a moment, filled up with blanks.
_LENGTH = 64
#: How long to wait for the disk at the end, s.
_PATIENCE = 2.0


def _now() -> datetime:
    return datetime.now(UTC)


class KeptHold(Hold):
    """Remembers over restarts who stopped the body, if only a person may release it.

    If the file cannot be written, a line on stderr says so, and says that a restart will not know
    of a Stop.

    Parameters
    ----------
    path
        The file.
    programs_may_release
        As in :class:`~miburi.serving.press.Hold`.
    now
        The present moment by the computer's clock.
    """

    def __init__(
        self,
        path: Path,
        *,
        programs_may_release: bool = False,
        now: Callable[[], datetime] = _now,
    ) -> None:
        super().__init__(programs_may_release=programs_may_release)
        self._now, self._told = now, SimpleQueue[str | None]()
        text = _read(path)
        if text:
            self.before = _stop_of(text)
        self._told.put(text)
        self._thread = threading.Thread(target=_write, args=(path, self._told), daemon=True)
        self._thread.start()

    def press(self, by: By) -> bool:
        """Record a press, also for the next start; return whether it changes who holds the body."""
        changed = super().press(by)
        if changed and self.by is not None and self.before is None:
            self._told.put(f"{by} {self._now().isoformat()}")
        return changed

    def end(self, *, by_person: bool) -> By:
        """Forget the Stop after a release; return who released it."""
        self._told.put("")
        return super().end(by_person=by_person)

    def close(self) -> None:
        """Wait until the disk has the latest Stop or release."""
        self._told.put(None)
        self._thread.join(_PATIENCE)


def _read(path: Path) -> str:
    """Return what an earlier start has written, or nothing; a person's Stop if that is unknown."""
    try:
        content = path.read_bytes()
        text = content.decode().strip()
        if text:
            _stop_of(text)
        if content:
            return text
        wrong = "is damaged"
    except (FileNotFoundError, NotADirectoryError):
        return ""
    except OSError as error:
        wrong = f"cannot be read ({error.strerror})"
    except ValueError:
        wrong = "is damaged"
    print(
        f"miburi: {path} {wrong}, so the body is stopped until a person releases it: somebody may "
        "have pressed Stop.",
        file=sys.stderr,
    )
    return "person"


def _stop_of(text: str) -> tuple[By, datetime | None]:
    name, _, when = text.partition(" ")
    if name != who(name):
        raise ValueError(name)
    return who(name), datetime.fromisoformat(when) if when else None


def _write(path: Path, told: "SimpleQueue[str | None]") -> None:
    for text in iter(told.get, None):
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            content = text.ljust(_LENGTH)
            if not path.exists():
                write_whole(path, content, private=True)
                continue
            with path.open("r+b", buffering=0) as file:
                file.write(content.encode())
                file.truncate(_LENGTH)
                os.fsync(file.fileno())
        except OSError as error:
            print(
                f"miburi: {path}: cannot be written ({error.strerror}), so a restart will not know "
                "whether somebody pressed Stop.",
                file=sys.stderr,
            )
