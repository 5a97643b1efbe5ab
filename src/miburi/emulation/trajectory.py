"""The way that a servo makes of a goal: speed up, cruise, slow down."""

from dataclasses import dataclass
from functools import cached_property
from math import sqrt

__all__ = ["Segment"]

#: How the manual numbers the profiles in Moving Status.
_STEP, _RECTANGLE, _TRIANGLE, _TRAPEZOID = 0x00, 0x10, 0x20, 0x30


@dataclass(frozen=True)
class Segment:
    """A stretch of the servo's trajectory: from rest at ``origin`` to rest at ``goal``."""

    began: float
    origin: float
    goal: float
    speed: float  # steps/s; 0 for at once
    acceleration: float  # steps/s²; 0 for at once

    @classmethod
    def in_time(
        cls, began: float, origin: float, goal: float, whole: float, ramp: float
    ) -> "Segment":
        """Return a stretch that takes ``whole`` s, with ramps of ``ramp`` s, half of it at most."""
        ramp = min(ramp, whole / 2)
        speed = abs(goal - origin) / (whole - ramp) if whole else 0.0
        return cls(began, origin, goal, speed, speed / ramp if ramp else 0.0)

    @property
    def kind(self) -> int:
        """The profile's type, as Moving Status has it."""
        if self.speed == 0:
            return _STEP
        if self.acceleration == 0:
            return _RECTANGLE
        far = self.speed * self.speed / self.acceleration
        return _TRIANGLE if far > abs(self.goal - self.origin) else _TRAPEZOID

    @cached_property
    def _shape(self) -> tuple[float, float, float]:
        """Its ramp, s, the speed that it reaches, steps/s, and its whole time, s."""
        way = abs(self.goal - self.origin)
        if self.speed == 0 or way == 0:
            return 0.0, 0.0, 0.0
        ramp = self.speed / self.acceleration if self.acceleration else 0.0
        if self.acceleration and self.speed * ramp > way:
            ramp = sqrt(way / self.acceleration)
        top = self.acceleration * ramp if self.acceleration else self.speed
        return ramp, top, way / top + ramp

    def at(self, time: float) -> float:
        """Where the trajectory is at ``time``, in steps."""
        t = (time - self.began) / 1e6
        if t <= 0:
            return self.origin
        ramp, top, total = self._shape
        if t >= total:
            return self.goal
        if t < ramp:
            done = self.acceleration * t * t / 2
        elif t > total - ramp:
            done = abs(self.goal - self.origin) - self.acceleration * (total - t) ** 2 / 2
        else:
            done = top * (t - ramp / 2)
        return self.origin + done * (1 if self.goal > self.origin else -1)

    def speed_at(self, time: float, span: float) -> float:
        """How fast it is, in steps/s, over the latest ``span`` µs."""
        return (self.at(time) - self.at(time - span)) * 1e6 / span
