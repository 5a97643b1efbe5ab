"""Measure Laban's space, weight, time and flow in a recorded motion, as eight numbers.

As usual in affective movement analysis, the hull stands for space, the speed for time, the
acceleration for weight, and jerk and curvature for flow (Larboulette and Gibet, A review of
computable expressive descriptors of human motion, MOCO 2015; Wallbott, Bodily expression of
emotion, Eur. J. Soc. Psychol. 28, 1998; Hartmann, Mancini and Pelachaud, Implementing expressive
gesture synthesis for embodied conversational agents, GW 2005).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from miburi.errors import InputError, needs_extra

Array = NDArray[np.float64]

#: Below this speed, in m/s, a path has no direction and no curvature (our choice).
STILL = 0.01


@dataclass(frozen=True)
class Measures:
    """Measures of space, weight, time and flow in a recorded motion.

    Means are over time and both hands; v, a and j are the derivatives of a hand's path p(t).
    """

    duration: float  #: s
    volume: float  #: m³, of the convex hull of the paths of both hands and the head (space)
    path: float  #: m, ∫|v| dt, both hands together (space)
    mean_speed: float  #: m/s, |v| (time)
    mean_acceleration: float  #: m/s², |a| (weight)
    mean_jerk: float  #: m/s³, |j| (flow)
    #: 2 · max|p(t) − p(0)| ÷ ∫|v| dt, 0 to 1: 1 is straight there and straight back. (For motions
    #: that do not return, the literature divides path by displacement.)
    directness: float
    curvature: float  #: 1/m, median of |v × a| ÷ |v|³ while a hand moves (flow)


def measure(positions: Array, period: float) -> Measures:
    """Measure a recorded motion.

    ``positions``, shape (n, 9), in m, has the positions of right hand, left hand and head, taken
    every ``period`` s; n is at least 5.

    Raises InputError if the shape is wrong, a value is not finite, or the period is not positive;
    MiburiError if SciPy is not installed.
    """
    if positions.ndim != 2 or positions.shape[1] != 9 or len(positions) < 5:
        raise InputError(f"positions must have the shape (n, 9), n >= 5, got {positions.shape}.")
    if not np.all(np.isfinite(positions)):
        raise InputError("positions must be finite numbers.")
    if not period > 0:
        raise InputError(f"period must be more than 0 s, got {period!r}.")
    hands = positions[:, :6].reshape(-1, 2, 3)
    velocity, acceleration, jerk = (np.diff(hands, n, axis=0) / period**n for n in (1, 2, 3))
    speed = np.linalg.norm(velocity, axis=2)
    lengths = speed.sum(axis=0) * period
    farthest = np.linalg.norm(hands - hands[0], axis=2).max(axis=0)
    moved = lengths > STILL
    return Measures(
        duration=(len(positions) - 1) * period,
        volume=_hull_volume(positions.reshape(-1, 3)),
        path=float(lengths.sum()),
        mean_speed=float(speed.mean()),
        mean_acceleration=float(np.linalg.norm(acceleration, axis=2).mean()),
        mean_jerk=float(np.linalg.norm(jerk, axis=2).mean()),
        directness=float(np.mean(2 * farthest[moved] / lengths[moved])) if moved.any() else 0.0,
        curvature=_curvature(velocity, acceleration),
    )


def _hull_volume(points: Array) -> float:
    """Return the volume, in m³, of the convex hull of points, (n, 3) in m; 0 if they are flat."""
    try:
        from scipy.spatial import ConvexHull, QhullError
    except ModuleNotFoundError as error:
        raise needs_extra("studies", error) from error
    try:
        return float(ConvexHull(points).volume)
    except QhullError:  # the points lie in a plane
        return 0.0


def _curvature(velocity: Array, acceleration: Array) -> float:
    middle = (velocity[:-1] + velocity[1:]) / 2
    speed = np.linalg.norm(middle, axis=2)
    moving = speed > STILL
    if not moving.any():
        return 0.0
    across = np.linalg.norm(np.cross(middle[moving], acceleration[moving]), axis=1)
    return float(np.median(across / speed[moving] ** 3))
