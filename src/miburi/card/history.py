"""The latest reports of a card, and their times on the body's clock.

The history takes reports with their times of arrival and returns the body's state.
"""

from collections import deque

import numpy as np

from miburi.bodies.base import BodyState
from miburi.card.link import Report
from miburi.card.reading import PHASES, stop_of
from miburi.robot import JOINTS
from miburi.safety.profile import SECOND

#: Number of reports over which velocities are measured: 60 ms.
_VELOCITY_REPORTS = 4


class ReportHistory:
    """The latest reports of one card.

    ``step`` is the angle of an encoder step, in rad. The body's clock starts when the line's clock
    shows ``now``, in s.

    Attributes
    ----------
    began, heard
        When the body's clock started, and when a report was last heard, both in s on the line's
        clock.
    """

    def __init__(self, step: float, now: float) -> None:
        self._step = step
        self._reports: deque[Report] = deque(maxlen=_VELOCITY_REPORTS)
        self._offset = 0.0
        self._fresh = False
        self.began = self.heard = now

    def __bool__(self) -> bool:
        return bool(self._reports)

    @property
    def latest(self) -> Report:
        """The latest report."""
        return self._reports[-1]

    def expect_another_clock(self, now: float) -> None:
        """Prepare for a card whose clock has restarted; count its silence from ``now``, in s."""
        self._fresh, self.heard = True, now

    def add(self, report: Report, now: float) -> None:
        """Take in a report that was heard at ``now``, in s on the line's clock."""
        self.heard = now
        if self._fresh:
            self._fresh = False
            self._reports.clear()
            self._offset = now - self.began - report.time / SECOND
        self._reports.append(report)

    def start_clock(self, now: float) -> None:
        """Set the body's clock to 0 at the latest report; the first one may have been delayed."""
        self.began = now
        self._offset = self.heard - now - self.latest.time / SECOND

    def go_on(self, time: float) -> None:
        """Let the body's clock go on from ``time``, in s, at the latest report."""
        ahead = time - self._time_of(self.latest.time)
        self.began -= ahead
        self._offset += ahead

    def state(self) -> BodyState:
        """Return the body's state as the card reports it."""
        latest, first = self._reports[-1], self._reports[0]
        span = (latest.time - first.time) / SECOND
        moved = np.subtract(latest.positions, first.positions) * self._step
        return BodyState(
            time=self._time_of(latest.time),
            angles=np.multiply(latest.positions, self._step, dtype=np.float64),
            velocities=moved / span if span > 0 else np.zeros(len(JOINTS)),
            phase=PHASES[latest.phase],
            stop=stop_of(latest, self._time_of(latest.stop_time)),
        )

    def _time_of(self, micros: int) -> float:
        return micros / SECOND + self._offset
