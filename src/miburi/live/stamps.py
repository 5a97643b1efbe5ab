"""Convert times of the body's clock to the computer's clock."""

import time
from collections.abc import Callable

#: A stamp that is further than this, in ns, behind the computer's clock is set to that clock (our
#: choice). A smaller lag is normal on a busy computer.
LATE = 1_000_000_000


class Stamps:
    """Gives each state a time on the computer's clock, which ``clock`` returns in ns since 1970.

    Differences between stamps equal differences on the body's clock, so that speeds computed from
    them are right. If the body's clock halts, the stamps are set to the computer's clock.
    Stamps are never ahead of the computer's clock, and go back only if it does.
    """

    def __init__(self, clock: Callable[[], int] = time.time_ns) -> None:
        self._clock = clock
        self._ahead: int | None = None  # the computer's clock less the body's, ns
        self._last = 0

    def of(self, seconds: float) -> int:
        """Return the stamp, in ns, of a state at ``seconds`` on the body's clock."""
        now, then = self._clock(), round(seconds * 1e9)
        earliest = max(now - LATE, self._last)
        if self._ahead is None or not earliest <= then + self._ahead <= now:
            self._ahead = now - then
        self._last = then + self._ahead
        return self._last

    def now(self) -> int:
        """Return the computer's time, ns."""
        return self._clock()
