"""A servo's path to a goal: speed up, cruise, slow down.

If a new goal comes while the servo moves, the new path begins at its present speed (the manual's
*velocity override*). A profile without ramps reaches its speed at once.
"""

from dataclasses import dataclass
from functools import cached_property
from math import sqrt


@dataclass(frozen=True)
class Segment:
    """A stretch of the servo's trajectory: from ``origin`` to rest at ``goal``."""

    began: float
    origin: float
    goal: float
    speed: float  # steps/s; 0 for at once
    acceleration: float  # steps/s²; 0 for at once
    initial: float = 0.0  # steps/s at the origin, with its sign

    @cached_property
    def _shape(self) -> tuple[int, float, float, float, float]:
        """Direction, first ramp (s), cruising speed (steps/s), last ramp (s) and total time (s)."""
        way, a = self.goal - self.origin, self.acceleration
        if self.speed == 0 or (way == 0 and self.initial == 0):
            return 1, 0.0, 0.0, 0.0, 0.0
        if a == 0:
            return (1 if way > 0 else -1), 0.0, self.speed, 0.0, abs(way) / self.speed
        sign = 1 if way > self.initial * abs(self.initial) / (2 * a) else -1
        way, u = way * sign, self.initial * sign
        if u == 0:  # from rest; leave this arithmetic as it is: calibrations depend on its last bit
            ramp = self.speed / a
            ramp = sqrt(way / a) if self.speed * ramp > way else ramp
            return sign, ramp, a * ramp, ramp, way / (a * ramp) + ramp
        top = min(sqrt(max(a * way + u * u / 2, 0.0)), self.speed)
        first, last = abs(top - u) / a, top / a
        ramps = (first * (u + top) + last * top) / 2
        return sign, first, top, last, first + last + (max(way - ramps, 0.0) / top if top else 0.0)

    def at(self, time: float) -> float:
        """Return the position at ``time``, in steps."""
        t = (time - self.began) / 1e6
        if t <= 0:
            return self.origin
        sign, first, top, last, total = self._shape
        if t >= total:
            return self.goal
        u = self.initial * sign
        if t < first:
            done = u * t + (1 if top > u else -1) * self.acceleration * t * t / 2
        elif t > total - last:
            done = (self.goal - self.origin) * sign - self.acceleration * (total - t) ** 2 / 2
        else:
            done = top * (t - first / 2) if u == 0 else first * (u + top) / 2 + top * (t - first)
        return self.origin + done * sign

    def speed_at(self, time: float, span: float) -> float:
        """Return the mean speed over the latest ``span`` µs, in steps/s."""
        return (self.at(time) - self.at(time - span)) * 1e6 / span
