"""Compilation by Numba: kept on the disk, announced when it happens."""

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

Function = TypeVar("Function", bound=Callable[..., Any])

# Division by zero gives infinity, which costs nothing to allow, in place of an exception. NaN and
# infinity keep their meaning; a product and a sum may become one instruction.
_OPTIONS: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"contract", "nsz", "arcp"},
}
_HERE = Path(__file__).parent
_SOURCES = (
    "compiled.py", "bma/operators.py", "ik/kinematics.py", "ik/kernel.py", "servos/model.py",
    "bodies/friction.py", "free_motion.py",
)  # fmt: skip


def _writable_folder() -> Path | None:
    """Where compiled code is kept; of its own for each state of the sources.

    A compiled function contains those that it calls, and Numba watches a function's own file
    only: after a change in another it would go on with what is old.
    """
    digest = sha256(b"".join((_HERE / name).read_bytes() for name in _SOURCES)).hexdigest()
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    bases = [Path(chosen)] if chosen else [_HERE / "__pycache__"]
    if not chosen:
        with suppress(RuntimeError):  # there is no home
            bases.append(
                Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "miburi"
            )
    for base in bases:
        folder = base / f"compiled-{digest[:16]}"
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

    It is kept in ``NUMBA_CACHE_DIR``, where that is set, else beside the sources, else in the
    user's cache folder. Where nothing can be written, every process compiles anew and says so.
    """
    config: Any = numba.config
    usual = config.CACHE_DIR
    try:
        if _folder is not None:
            config.CACHE_DIR = str(_folder)
        # Numba's decorator is untyped, as its events are below.
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
