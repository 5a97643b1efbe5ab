"""Compilation by Numba: kept on the disk, announced when it happens."""

import sys
from collections.abc import Callable
from typing import Any, TypeVar

from numba import njit
from numba.core import event

Function = TypeVar("Function", bound=Callable[..., Any])

# NaN and infinity keep their meaning; a product and a sum may become one instruction.
_OPTIONS: dict[str, Any] = {"nogil": True, "fastmath": {"contract", "nsz", "arcp"}}
_kept = True


def compiled(function: Function) -> Function:
    """Compile a function at its first call, and keep the result on the disk where that can be.

    Numba keeps it beside the source, else in the user's cache folder, or where the environment
    variable ``NUMBA_CACHE_DIR`` says. Where none of them can be written, every process compiles
    anew and says so.
    """
    global _kept  # noqa: PLW0603
    if _kept:
        try:
            return njit(cache=True, **_OPTIONS)(function)  # type: ignore[no-any-return]
        except RuntimeError:  # Numba's word for: no folder can be written
            _kept = False
    return njit(**_OPTIONS)(function)  # type: ignore[no-any-return]


class _Announcer(event.Listener):
    """Says on standard error, once, that Miburi's functions are being compiled."""

    said = False

    def on_start(self, what: Any) -> None:
        name = getattr(what.data["dispatcher"], "__module__", "") or ""
        if name.startswith("miburi.") and not self.said:
            self.said = True
            print(f"Miburi compiles its solver ({_advice()}).", file=sys.stderr, flush=True)

    def on_end(self, what: Any) -> None:
        pass


def _advice() -> str:
    if _kept:
        return "once, about 20 s; later starts are quick"
    return (
        "about 20 s at every start, as no cache folder can be written; "
        "set NUMBA_CACHE_DIR to one that can"
    )


event.register("numba:compile", _Announcer())  # type: ignore[no-untyped-call]
