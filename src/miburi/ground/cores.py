"""What a program may take of its computer: count the cores, and come before others."""

import os
from contextlib import suppress
from pathlib import Path

__all__ = ["available_cores", "come_first"]

#: How nice a live partner is to other programs; 0 is usual, -20 the least (ours).
_NICE = -10


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
        Leave the terminal's session. Linux shares its time among sessions first, so a process in
        one of its own gets as much as all programs of another together, whoever started it.
    """
    with suppress(OSError, AttributeError):  # not allowed; not a Unix
        if apart:
            os.setsid()
        usual = os.getpriority(os.PRIO_PROCESS, 0)
        os.setpriority(os.PRIO_PROCESS, 0, min(usual, _NICE))
        if apart:
            Path("/proc/self/autogroup").write_text(str(_NICE), encoding="ascii")
