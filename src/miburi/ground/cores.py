"""Processor time: count the available cores, and raise the priority of a process."""

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

#: The nice value of a live partner (our choice); the default is 0, the highest priority -20.
_NICE = -10
#: Linux first divides its time among sessions; this file holds this session's nice value.
_AUTOGROUP = Path("/proc/self/autogroup")


def available_cores() -> int:
    """Return the number of cores that this process may use, at least 1."""
    try:
        return len(os.sched_getaffinity(0))  # Linux only
    except AttributeError:
        return os.cpu_count() or 1


def come_first(*, apart: bool = False) -> None:
    """Give this process, and the processes it starts, priority over other programs if allowed.

    On Linux, root and users whose ``LimitNICE`` allows it may do so. Otherwise the priority stays
    as it is, and the partner may react late on a busy computer. If the process leaves the
    terminal's session (``apart``), Linux gives it as much processor time as a whole session, even
    without root's rights.
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
    """Raise the priority of this process and its whole terminal session while the block runs.

    The whole session's priority is raised because the process must stay in it to receive Ctrl-C.
    """
    usual = nice = None
    with suppress(OSError, AttributeError):
        usual = os.getpriority(os.PRIO_PROCESS, 0)
    come_first()
    with suppress(OSError):
        nice = re.search(r"nice (-?\d+)", _AUTOGROUP.read_text(encoding="ascii"))
        _AUTOGROUP.write_text(str(_NICE), encoding="ascii")
    try:
        yield
    finally:
        with suppress(OSError):
            if usual is not None:
                os.setpriority(os.PRIO_PROCESS, 0, usual)
            if nice is not None:
                _AUTOGROUP.write_text(nice[1], encoding="ascii")
