"""How many processor cores there are to work on."""

import os

__all__ = ["available_cores"]


def available_cores() -> int:
    """Return the number of cores that this process may use, at least 1."""
    try:
        return len(os.sched_getaffinity(0))  # only Linux tells those
    except AttributeError:
        return os.cpu_count() or 1
