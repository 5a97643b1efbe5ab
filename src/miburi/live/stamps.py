"""Convert times of the body's clock to the computer's clock."""

import time
from collections.abc import Callable

#: If a stamp lags behind the clock by more than this, ns, it is set to the clock (our choice). A
#: smaller lag is normal on a busy computer.
LATE = 1_000_000_000


class Stamps:
    """Gives each state a time by the computer's clock.

    Differences between stamps equal those of the body's clock, so that speeds computed from them
    are right. If the body's clock halts or the body is replaced, the stamps are set to the
    computer's clock. They are never ahead of that clock, and go back only if it does. ``clock``
    returns the time in ns since 1970.
    """

    def __init__(self, clock: Callable[[], int] = time.time_ns) -> None:
        self._clock = clock
        self._ahead: int | None = None  # the computer's clock less the body's, ns
        self._last = 0

    def of(self, seconds: float) -> int:
        """Return the stamp of a state at ``seconds`` on the body's clock, in ns."""
        now, then = self._clock(), round(seconds * 1e9)
        earliest = max(now - LATE, self._last)
        if self._ahead is None or not earliest <= then + self._ahead <= now:
            self._ahead = now - then
        self._last = then + self._ahead
        return self._last

    def now(self) -> int:
        """Return the computer's time, ns."""
        return self._clock()
