"""Find the newest entries of a deque without reading all of it."""

from collections import deque
from collections.abc import Callable
from itertools import takewhile
from typing import TypeVar

Entry = TypeVar("Entry")


def newer(kept: deque[Entry], than: int, number: Callable[[Entry], int]) -> list[Entry]:
    """Return the entries with a number above ``than``, oldest first; numbers rise along the queue.

    Another thread may append entries meanwhile.
    """
    if not kept or number(kept[-1]) <= than:
        return []
    found = [*takewhile(lambda entry: number(entry) > than, reversed(kept.copy()))]
    found.reverse()
    return found
