"""From free motion to guards: what the contact rule must grant the servos of one robot (ours).

A calibration needs only what a card sees: encoder readings beside the commanded profile of each
move. So the same code serves the simulated servos and those on a bench.
"""

from dataclasses import dataclass

import numpy as np

from miburi.motion import FINE, SECOND, Profile, Steps


@dataclass(frozen=True)
class Trace:
    """One move as the card saw it.

    Attributes
    ----------
    profile, start, direction
        As :class:`miburi.contact.Watch` takes them.
    positions
        (n, 8) steps, the encoders at the move's start and every ``interval`` after it.
    interval
        µs.
    """

    profile: Profile
    start: Steps
    direction: Steps
    positions: Steps
    interval: int = SECOND // 100

    @property
    def travel(self) -> Steps:
        """Travel of each motor at each reading, (n, 8) in 1/256 steps."""
        travel: Steps = (self.positions - self.start) * self.direction * FINE
        return travel

    def expected(self, lag: Steps) -> Steps:
        """Travel that the profile, ``lag`` (8,) µs late, commanded at each reading, (n, 8)."""
        times = np.arange(len(self.positions), dtype=np.int64)[:, None] * self.interval
        return self.profile.position(times - lag)
