"""Who sends wrong tokens, for the log."""

import logging
import time
from collections import Counter
from collections.abc import Callable

from miburi.serving.allowance import Allowance

#: Lines per second and address, and for all addresses together with a burst (our choice).
_RATE, _RATE_OF_ALL, _BURST = 1 / 60, 1 / 10, 20.0
#: The most addresses whose requests are counted (our choice).
_MOST = 1000
_LOG = logging.getLogger(__name__)


class Strangers:
    """Logs wrong tokens: a line a minute at most for each address, with the count.

    ``clock`` returns the time, s.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._lines = Allowance(_RATE, 1.0, clock)
        self._lines_of_all = Allowance(_RATE_OF_ALL, _BURST, clock)
        self._unsaid: Counter[str] = Counter()

    def note(self, who: str) -> None:
        """Count a request with a wrong token from an address."""
        if len(self._unsaid) >= _MOST:
            self._unsaid.clear()
        self._unsaid[who] += 1
        if self._lines.take(who) and self._lines_of_all.take("all"):
            _LOG.warning("requests with a wrong token from %s: %d", who, self._unsaid.pop(who))
