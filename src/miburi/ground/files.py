"""Write files so that each is either complete under its final name or not there at all."""

import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from glob import escape
from itertools import chain, count
from pathlib import Path

from miburi.errors import InputError, OutputError


@contextmanager
def whole_files(folder: Path | str) -> Iterator[Path]:
    """Yield a hidden draft folder; when the block ends, move its files to ``folder``.

    The folder is created if missing, and files of the same names are replaced one by one. If the
    block raises, the draft is deleted.

    Raises
    ------
    OutputError
        The folder is not writable, or the disk is full.
    """
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(prefix=".unfinished-", dir=folder))
    except OSError as error:
        raise _write_error(folder, error) from error
    try:
        yield draft
        for file in sorted(draft.iterdir()):
            with file.open("r+b") as written:  # Windows flushes only what may be written
                os.fsync(written.fileno())
            file.replace(folder / file.name)
    except OSError as error:
        raise _write_error(folder, error) from error
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def write_whole(path: Path, text: str, *, private: bool = False) -> None:
    """Write a text to a temporary file beside ``path``, and rename it once it is on the disk.

    A ``private`` file can be read by the owner of its folder alone, even if root writes it.

    Raises
    ------
    OSError
        The place cannot be written to, or is full; the file that was there is unchanged.
    """
    draft = _draft(path)
    try:
        draft.unlink(missing_ok=True)
        draft.touch(mode=0o600 if private else 0o666)
        with draft.open("w", encoding="utf-8", newline="\n") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        if private and hasattr(os, "chown"):
            with suppress(OSError):
                folder = path.parent.stat()
                os.chown(draft, folder.st_uid, folder.st_gid)
        draft.replace(path)
    except OSError:
        with suppress(OSError):
            draft.unlink()
        raise


def remove_whole(path: Path) -> None:
    """Delete what :func:`write_whole` wrote, and the draft that a killed program has left.

    Raises
    ------
    OSError
        The folder cannot be written to.
    """
    for file in (path, _draft(path)):
        file.unlink(missing_ok=True)


def put_aside(path: Path) -> Path:
    """Rename a file that cannot be used to end in ``.bad``, and return its new path.

    An earlier one is not replaced: the second ends in ``.bad-2``.

    Raises
    ------
    OSError
        The folder cannot be written to.
    """
    bad = path.with_name(f"{path.name}.bad")
    names = chain([bad], (bad.with_name(f"{bad.name}-{n}") for n in count(2)))
    aside = next(name for name in names if not name.exists())
    path.replace(aside)
    return aside


def put_aside_before(path: Path) -> list[Path]:
    """Return the files that :func:`put_aside` has renamed."""
    return sorted(path.parent.glob(f"{escape(path.name)}.bad*"))


def check_readable(path: Path) -> None:
    """Check that a file can be read, if there is one.

    Raises
    ------
    InputError
        It cannot be read, for instance because it belongs to somebody else.
    """
    try:
        with path.open("rb") as file:
            file.read(1)
    except (FileNotFoundError, NotADirectoryError):
        return
    except OSError as error:
        owner = "it may belong to another user"
        with suppress(OSError, KeyError, NotImplementedError):
            owner = f"it belongs to {path.owner()}"
        raise InputError(
            f"{path}: cannot be read ({error.strerror or error}); {owner}. It was left as it is. "
            "Make it readable to the user who runs Miburi, as after a restore by root: "
            f"sudo chown -R USER {path.parent}"
        ) from error


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Keep other programs that call this out of a folder, which is created if missing.

    On Windows, or if the folder cannot be written to, no program is kept out.

    Raises
    ------
    OutputError
        Another program is in the folder.
    """
    with ExitStack() as end:
        if sys.platform != "win32":
            import fcntl

            try:
                folder.mkdir(parents=True, exist_ok=True)
                lock = os.open(folder / ".lock", os.O_RDONLY | os.O_CREAT, 0o600)
                end.callback(os.close, lock)
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)  # it ends with this process
            except BlockingIOError:
                raise OutputError(
                    f"another Miburi keeps its files in {folder}: use its page or end it; or give "
                    "this one a folder of its own with --folder."
                ) from None
            except OSError:
                pass  # nothing is written there, or the disk has no locks
        yield


def _draft(path: Path) -> Path:
    return path.with_name(f".{path.name}.new")


def _write_error(folder: Path, error: OSError) -> OutputError:
    return OutputError(
        f"{folder.absolute()}: cannot write there: {error.strerror or error}. "
        "Choose another place, or make room."
    )
