"""Rate limits for many clients."""

import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass
class Allowance:
    """A token bucket for each of many keys."""

    rate: float  # how many tokens are added a second
    burst: float  # how many a bucket holds
    clock: Callable[[], float] = time.monotonic  # returns the time, s
    _left: OrderedDict[str, tuple[float, float]] = field(default_factory=OrderedDict)

    def take(self, key: str, amount: float = 1.0) -> bool:
        """Take ``amount`` tokens from the bucket of a key; return False if it has fewer."""
        now = self.clock()
        left, then = self._left.pop(key, (self.burst, now))
        left = min(self.burst, left + (now - then) * self.rate)
        enough = left >= amount
        self._left[key] = (left - amount if enough else left, now)
        while len(self._left) > 1000:
            self._left.popitem(last=False)
        return enough
