"""``@compiled`` makes a function fast: Numba compiles it when it is first called.

The compiled code is kept on the disk, so that only the first start has to wait; a line on standard
error announces the wait.
"""

import atexit
import os
import shutil
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core import event

import miburi

Function = TypeVar("Function", bound=Callable[..., Any])

# Division by zero gives infinity instead of an exception, which is faster. NaN and infinity keep
# their meaning; a product and a sum may become one instruction. No C code calls these functions, so
# they have no wrappers for C; they compile 10 % faster that way.
_OPTIONS: dict[str, Any] = {
    "nogil": True,
    "no_cfunc_wrapper": True,
    "error_model": "numpy",
    "fastmath": {"contract", "nsz", "arcp"},
}
#: The folders of the modules with ``@compiled`` functions, relative to the package's root.
FOLDERS = ("calibration", "ik", "servos")


def state_of_sources(root: Path) -> str:
    """Return a hash of this file and of all modules in ``FOLDERS`` below ``root``.

    Numba only watches the file of a function, but the compiled code includes the functions that
    it calls. Without the hash, a change in another file would leave old code in use.
    """
    digest = sha256(Path(__file__).read_bytes())
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*.py")):
            digest.update(f"\0{path.relative_to(root).as_posix()}\0".encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_folder(root: Path) -> Path | None:
    """Return a folder for code compiled from the sources below ``root``; None if no folder works.

    Each state of the sources has a folder of its own. If a folder holds code but is read-only, as
    in an image that somebody else has built, it is copied to the first writable folder, or else to
    a temporary folder for the life of this process.
    """
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    bases = [Path(chosen)] if chosen else [root / "__pycache__"]
    if not chosen:
        with suppress(RuntimeError):  # there is no home folder
            bases.append(
                Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "miburi"
            )
    folders = [base / f"compiled-{state_of_sources(root)}" for base in bases]
    full = next((folder for folder in folders if _is_full(folder)), None)
    folder = next((folder for folder in folders if _can_be_written(folder)), None)
    if full is None or full == folder:
        return folder
    try:
        if folder is None:
            folder = Path(tempfile.mkdtemp(prefix="miburi-"))
            atexit.register(shutil.rmtree, folder, ignore_errors=True)
        if not _is_full(folder):
            shutil.copytree(full, folder, dirs_exist_ok=True)
    except OSError:  # then the functions are compiled again
        return folder
    return folder


def _is_full(folder: Path) -> bool:
    return any(folder.rglob("*.nbi"))


def _can_be_written(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


#: The folder that keeps compiled code; None if no folder can be used.
CACHE = cache_folder(Path(miburi.__file__).parent)


def compiled(function: Function) -> Function:
    """Compile a function when it is first called, and keep the result on the disk.

    The code goes to ``NUMBA_CACHE_DIR`` if that is set, else beside the sources, else to the user's
    cache folder. If none of these folders can be written and none holds code, every process
    compiles again and says so.
    """
    config: Any = numba.config
    default = config.CACHE_DIR
    try:
        if CACHE is not None:
            config.CACHE_DIR = str(CACHE)
        # Numba's decorator is untyped, and so are its events below.
        return numba.njit(cache=CACHE is not None, **_OPTIONS)(function)  # type: ignore[no-any-return]
    finally:
        config.CACHE_DIR = default


class _Announcer(event.Listener):
    """Say once on standard error that Miburi is compiling; in a terminal, name each function."""

    announced, depth = False, 0

    def on_start(self, what: Any) -> None:
        name = getattr(what.data["dispatcher"], "__module__", "") or ""
        if not self.announced and not name.startswith("miburi."):
            return
        if not self.announced:
            print(announcement(), file=sys.stderr, flush=True)
        self.announced = True
        self.depth += 1
        if sys.stderr.isatty():
            function = getattr(what.data["dispatcher"], "__name__", "")
            print(f"\r\033[K  {function} …", end="", file=sys.stderr, flush=True)

    def on_end(self, what: Any) -> None:  # noqa: ARG002  (Numba names it)
        if not self.announced:
            return
        self.depth -= 1
        if self.depth == 0 and sys.stderr.isatty():
            print("\r\033[K", end="", file=sys.stderr, flush=True)


def announcement() -> str:
    """Return the message that Miburi is compiling, how long it takes and how often it is needed."""
    often = "once; later starts are quick"
    if CACHE is None:
        often = (
            "at every start, because no cache folder is writable; set NUMBA_CACHE_DIR to a "
            "writable one"
        )
    return (
        "Miburi is compiling its solver; this takes 5 to 20 s, or 1 to 2 minutes on a Raspberry Pi "
        f"({often})."
    )


event.register("numba:compile", _Announcer())  # type: ignore[no-untyped-call]
