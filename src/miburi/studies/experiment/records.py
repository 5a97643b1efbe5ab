"""The records of an experiment."""

from dataclasses import dataclass

from miburi.robot import Array


@dataclass(frozen=True)
class StopRecord:
    """A stop: what the motors reported, what the simulation knows, and the moods; SI units."""

    time: float
    motor: str | None
    sign: str | None
    ratio: float | None
    contact_time: float | None
    latency: float | None
    peak_force: float
    mood_before: float
    mood_after: float


@dataclass(frozen=True)
class GestureRecord:
    """A performed gesture; ``gesture`` is its name.

    ``extent`` is the largest distance of a hand from where it began, in m. ``mean_speed`` is the
    path length of both hands over 2 × duration, in m/s. ``complete`` is false if the gesture was
    broken off.
    """

    start: float
    end: float
    feeling: str
    gesture: str | None
    mood: float
    extent: float
    mean_speed: float
    complete: bool


@dataclass(frozen=True)
class Healing:
    """The mood after the gestures, at ``times`` in s, and the mood of an ``untouched`` control."""

    time_constant: float
    times: list[float]
    moods: list[float]
    untouched: list[float]


@dataclass(frozen=True)
class WindowRecord:
    """One motor as the contact rule saw it: its mean speed and its expected speed in a window.

    Both speeds are in rad/s.

    ``ratio`` includes the rule's slack, so it crosses the limit where the body stops.
    """

    time: float
    measured: float
    commanded: float
    ratio: float


@dataclass
class FilmFrame:
    """One picture of the film: true angles (8,), the hand's pose (7,), and the caption."""

    time: float
    angles: Array
    hand: Array
    feeling: str
    mood: float
    phase: str
