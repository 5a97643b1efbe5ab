"""The contact rule exactly as the paper prints it (Eqs. 1 and 2), for comparison.

:class:`PrintedRule` replaces :class:`~miburi.safety.contact.Rule`. At the end of each period it
compares, for each motor that has not arrived, the measured speed with the commanded speed. If a
motor that lags and has the acceleration a is sent the speed v, it covers v (p − lag − v / 2a) in
the first period p. So it passes only if lag + v / 2a is at most 0.0628 p, which is 6.28 ms. With
real servos that sum is larger, and they brake as well, so the rule stops nearly every free move;
``docs/paper.md`` shows the share of free moves that pass, for many lags and accelerations.
"""

import numpy as np

from miburi.safety.contact import (
    PAPER_RATIO,
    UNLOADED,
    Contact,
    Flags,
    Loading,
    Rule,
    Sign,
    Watch,
    Window,
    worst,
)  # fmt: skip
from miburi.safety.profile import FINE, SECOND, Profile, Steps


def is_slow_as_printed(
    travel: Steps, speed: Steps, elapsed: int, ratio: int = PAPER_RATIO
) -> Flags:
    """Return which motors moved slower than 0.9372 of the speed sent (Eqs. 1 and 2).

    ``travel``, (8,), is how many steps each motor moved in the window, in either direction;
    ``elapsed`` is the length of the window in µs. ``speed``, (8,) steps/s, is the speed sent: 0 for
    a motor that has nowhere to go. ``ratio`` is the limit in ten-thousandths. For a real servo the
    result is True in the first and last period even of a free move.
    """
    slow: Flags = np.abs(travel) * 10_000 * SECOND < speed * ratio * elapsed
    return slow


class PrintedRule(Rule):
    """The paper's rule as printed, for comparison with :class:`~miburi.safety.contact.Rule`."""

    def watch(
        self, profile: Profile, start: Steps, direction: Steps, loading: Loading = UNLOADED
    ) -> Watch:
        """Begin to watch one move."""
        return _PrintedWatch(self, profile, start, direction, loading)


class _PrintedWatch(Watch):
    def look(self, positions: Steps, time: int) -> Contact | None:
        if time < self._period_ends:
            return None
        self._period_ends += self.rule.period
        travel = self._travel(positions)
        moved = travel - self._measured
        self._measured = travel
        # Motors that have arrived, or that were not asked to move, are not checked.
        going = self._goal - travel > self._arrival
        sent = np.where(going, self.profile.speed // FINE, 0)
        slow = is_slow_as_printed(moved // FINE, sent, self.rule.period, self.rule.ratio)
        due = sent * FINE * self.rule.period // SECOND
        length = np.full_like(due, self.rule.period)
        self.window = Window(moved, due, moved, sent > 0, length)
        return worst(Sign.SPEED, slow, self.window) if slow.any() else None
