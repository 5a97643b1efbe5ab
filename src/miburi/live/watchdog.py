"""The watchdog, which stops the body from outside the loop if the loop is late.

The loop calls :meth:`Watchdog.beat` at every step, and a separate thread calls
:meth:`Watchdog.look`. The functions that the watchdog calls when the loop is late, ``late`` and
``dead``, must work without the loop.
"""

import threading
import time
from collections.abc import Callable
from typing import NamedTuple

_LOOK = 0.05
#: If two looks are further apart than this, in s, the watchdog's own process slept (our choice).
_ASLEEP = 1.0


class Lateness(NamedTuple):
    """How late a beat may be, in s, before the body is stopped or the loop abandoned (our choice).

    A slow computer may need more.
    """

    stop: float = 0.25
    give_up: float = 10.0


USUAL = Lateness()


class Watchdog:
    """Waits for the beats of a loop, one every ``period`` s.

    It calls ``late`` once in each delay that is longer than ``lateness.stop``. It calls ``dead``
    only once, in the first delay that is longer than ``lateness.give_up``.

    Parameters
    ----------
    apart
        Whether the beats come from another process. If they do, the time for which this process
        sleeps, as on a closed laptop, does not count as a delay.
    """

    def __init__(
        self,
        period: float,
        late: Callable[[], None],
        dead: Callable[[], None],
        lateness: Lateness = USUAL,
        clock: Callable[[], float] = time.monotonic,
        *,
        apart: bool = False,
    ) -> None:
        self._period, self._late, self._dead, self._clock = period, late, dead, clock
        self._lateness = lateness
        self._beat = self._looked = clock()
        self._apart = apart
        self._is_late = self._is_dead = False

    def beat(self) -> None:
        """Record that the loop is alive."""
        self._beat = self._clock()
        self._is_late = False

    def look(self) -> None:
        """Check how late the loop is, and call ``late`` or ``dead`` if it is too late."""
        now = self._clock()
        slept, self._looked = now - self._looked, now
        if self._apart and slept > _ASLEEP:
            self._beat += slept
        behind = now - self._beat - self._period
        if behind > self._lateness.stop and not self._is_late:
            self._is_late = True
            self._late()
        if behind > self._lateness.give_up and not self._is_dead:
            self._is_dead = True
            self._dead()

    def watch(self, over: threading.Event) -> None:
        """Look until ``over`` is set; run this in a separate thread."""
        while not over.wait(_LOOK):
            self.look()
