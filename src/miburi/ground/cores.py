"""What a program may take of its computer: count the cores, and come before others."""

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

__all__ = ["available_cores", "come_first", "coming_first"]

#: How nice a live partner is to other programs; 0 is usual, -20 the least (ours).
_NICE = -10
#: Linux shares its time among sessions first, each with a nice of its own.
_AUTOGROUP = Path("/proc/self/autogroup")


def available_cores() -> int:
    """Return the number of cores that this process may use, at least 1."""
    try:
        return len(os.sched_getaffinity(0))  # Linux only
    except AttributeError:
        return os.cpu_count() or 1


def come_first(*, apart: bool = False) -> None:
    """Let this process, and those that it starts, come before other programs where that is allowed.

    Linux allows it to root, and to whom a limit grants it (``LimitNICE``). Elsewhere nothing
    changes: a busy computer then answers later.

    Parameters
    ----------
    apart
        Leave the terminal's session. A process in one of its own gets as much as all programs of
        another together, whoever started it.
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
    """Let this process and its terminal's session come first meanwhile.

    A process that hears Ctrl-C cannot leave its session, so the whole session comes first with it,
    and is as it was afterwards.
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
