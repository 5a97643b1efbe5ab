"""A program's share of its computer: count the cores it may use, and get priority."""

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

__all__ = ["available_cores", "come_first", "coming_first"]

#: How nice a live partner is to other programs; 0 is usual, -20 the least (ours).
_NICE = -10
#: Linux divides its time among sessions first, each with a nice value of its own.
_AUTOGROUP = Path("/proc/self/autogroup")


def available_cores() -> int:
    """Return the number of cores that this process may use, at least 1."""
    try:
        return len(os.sched_getaffinity(0))  # Linux only
    except AttributeError:
        return os.cpu_count() or 1


def come_first(*, apart: bool = False) -> None:
    """Give this process, and those that it starts, priority over other programs if allowed.

    On Linux, root is allowed to do so, and users whose limit permits it (``LimitNICE``). Otherwise
    nothing changes, and a busy computer answers later.

    Parameters
    ----------
    apart
        Leave the terminal's session. A process in a session of its own gets as much time as
        all programs of another session together, whoever started it.
    """
    with suppress(OSError, AttributeError):  # not allowed; not a Unix
        if apart:
            os.setsid()
        usual = os.getpriority(os.PRIO_PROCESS, 0)
        os.setpriority(os.PRIO_PROCESS, 0, min(usual, _NICE))
        if apart:
            _AUTOGROUP.write_text(str(_NICE), encoding="ascii")


@contextmanager
def coming_first() -> Iterator[None]:
    """Give this process priority, and, while the block runs, its whole terminal session, too.

    A process that hears Ctrl-C cannot leave its session, so the whole session gets priority with
    it, and loses it afterwards.
    """
    come_first()
    nice = None
    with suppress(OSError):
        nice = re.search(r"nice (-?\d+)", _AUTOGROUP.read_text(encoding="ascii"))
        _AUTOGROUP.write_text(str(_NICE), encoding="ascii")
    try:
        yield
    finally:
        with suppress(OSError):
            if nice is not None:
                _AUTOGROUP.write_text(nice[1], encoding="ascii")
