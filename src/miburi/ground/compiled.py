"""Compilation by Numba: a decorator for functions that must be fast.

Compiled code is kept on the disk, so that only the first start waits for it; a line on standard
error announces the wait.
"""

import os
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

__all__ = ["FOLDERS", "Function", "compiled", "state_of_sources"]

Function = TypeVar("Function", bound=Callable[..., Any])

# Division by zero gives infinity, which costs nothing to allow, in place of an exception. NaN and
# infinity keep their meaning; a product and a sum may become one instruction.
_OPTIONS: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"contract", "nsz", "arcp"},
}
_ROOT = Path(miburi.__file__).parent
#: The folders, from the package's root, of the modules with compiled functions.
FOLDERS = ("bma", "ik", "servos")


def state_of_sources(root: Path) -> str:
    """Return a name for what the modules in ``FOLDERS`` below ``root``, and this one, contain.

    A compiled function contains those that it calls, and Numba watches a function's own file
    only: after a change in another file it would go on with old code.
    """
    digest = sha256(Path(__file__).read_bytes())
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*.py")):
            digest.update(f"\0{path.relative_to(root).as_posix()}\0".encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _writable_folder() -> Path | None:
    """Return the folder for compiled code, one for each state of the sources."""
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    bases = [Path(chosen)] if chosen else [_ROOT / "__pycache__"]
    if not chosen:
        with suppress(RuntimeError):  # there is no home
            bases.append(
                Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "miburi"
            )
    for base in bases:
        folder = base / f"compiled-{state_of_sources(_ROOT)}"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=folder).close()
        except OSError:
            continue
        return folder
    return None


_folder = _writable_folder()


def compiled(function: Function) -> Function:
    """Compile a function at its first call, and keep the result on the disk where that can be.

    The place is ``NUMBA_CACHE_DIR`` where that is set, else a folder beside the sources, else the
    user's cache folder. If none of them can be written, every process compiles anew and says so.
    """
    config: Any = numba.config
    usual = config.CACHE_DIR
    try:
        if _folder is not None:
            config.CACHE_DIR = str(_folder)
        # Numba's decorator is untyped, and so are its events below.
        return numba.njit(cache=_folder is not None, **_OPTIONS)(function)  # type: ignore[no-any-return]
    finally:
        config.CACHE_DIR = usual


class _Announcer(event.Listener):
    """Says on standard error, once, that Miburi's functions are being compiled."""

    said = False

    def on_start(self, what: Any) -> None:
        name = getattr(what.data["dispatcher"], "__module__", "") or ""
        if self.said or not name.startswith("miburi."):
            return
        self.said = True
        words = f"Miburi compiles its solver, which takes about 20 s ({_often()})."
        print(words, file=sys.stderr, flush=True)

    def on_end(self, what: Any) -> None:
        pass


def _often() -> str:
    if _folder is not None:
        return "once; later starts are quick"
    return "at every start, as no cache folder can be written; set NUMBA_CACHE_DIR to one that can"


event.register("numba:compile", _Announcer())  # type: ignore[no-untyped-call]
