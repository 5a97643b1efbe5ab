"""The emotional model: emotion, feeling and mood, eight numbers each on three time scales.

Section 4 of the paper: the emotion follows the very last events, the feeling those of a longer
time, the mood those of the longest. A stimulus acts on the emotion at once; the feeling takes up
its share while the emotion fades, and the mood while the feeling fades::

    emotion  x' = −x/τe
    feeling  p' = −p/τe    x' = −x/τf + p/τe
    mood     p' = −p/τf    x' = −x/τm + p/τf

with x the level and p what it has yet to take up. Support, inhibition, habituation and
saturation act at the stimulus, as a jump; between stimuli everything is linear and integrated
exactly, so that a step of an hour costs what a step of a millisecond does. As x + p can only
fall between jumps, and no jump lifts it above 1, every level stays in [0, 1].
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, nan
from typing import Any, Protocol, Self

import numpy as np

from miburi.errors import InputError
from miburi.temperament import FEELINGS, LEVELS, SOURCES, Array, Temperament, shipped_temperament

__all__ = ["CONTACT_FACTOR", "FEELINGS", "LEVELS", "SOURCES"]
__all__ += ["EmotionalModel", "Expression", "FeelingModel", "Stimulus"]

#: What an encounter leaves of every mood (Section 4: decreased by 20 %).
CONTACT_FACTOR = 0.8
STATE_VERSION = 1


@dataclass(frozen=True)
class Stimulus:
    """Somebody said, showed or did something.

    Parameters
    ----------
    feeling
        One of ``FEELINGS``.
    strength
        0 to 1.
    source
        One of ``SOURCES``; the temperament weighs them.

    Raises
    ------
    InputError
        A name is unknown or the strength is outside [0, 1].
    """

    feeling: str
    strength: float
    source: str = "application"

    def __post_init__(self) -> None:
        _known(self.feeling, FEELINGS, "feeling")
        _known(self.source, SOURCES, "source")
        object.__setattr__(self, "strength", _unit(self.strength, "strength"))


@dataclass(frozen=True)
class Expression:
    """What the body shows: a feeling, and its mood as the intensity μ in [0, 1]."""

    feeling: str
    mood: float

    def __post_init__(self) -> None:
        _known(self.feeling, FEELINGS, "feeling")
        object.__setattr__(self, "mood", _unit(self.mood, "mood"))


class FeelingModel(Protocol):
    """What a partner asks of an emotional model, whatever is inside."""

    @property
    def time(self) -> float:
        """Seconds lived."""

    @property
    def emotion(self) -> Array:
        """The fastest level, (8,) in [0, 1]."""

    @property
    def feeling(self) -> Array:
        """The middle level, (8,) in [0, 1]."""

    @property
    def mood(self) -> Array:
        """The slowest level, (8,) in [0, 1], with what contact has taken from it."""

    def stimulate(self, stimulus: Stimulus) -> None:
        """Take in what happened now."""

    def contact(self) -> None:
        """Lower every mood, as the robot was touched while it moved."""

    def step(self, dt: float) -> None:
        """Let ``dt`` seconds pass."""

    def express(self) -> Expression | None:
        """Return what the body shows now, or nothing."""

    def set_state(
        self,
        *,
        emotion: Mapping[str, float] | None = None,
        feeling: Mapping[str, float] | None = None,
        mood: Mapping[str, float] | None = None,
        hold: bool = False,
    ) -> None:
        """Set whole levels by hand."""

    def save(self) -> dict[str, Any]:
        """Return the state as what JSON can carry."""


class EmotionalModel:
    """Emotion, feeling and mood as linear cascades between stimuli.

    Parameters
    ----------
    temperament
        All constants; the default temperament if none is given.

    Examples
    --------
    >>> model = EmotionalModel()
    >>> model.stimulate(Stimulus("happiness", 0.8, "speech"))
    >>> model.express().feeling
    'happiness'
    """

    def __init__(self, temperament: Temperament | None = None) -> None:
        self.temperament = temperament or shipped_temperament()
        self._time = 0.0
        self._levels = np.zeros((3, 8))
        self._pending = np.zeros((3, 8))  # what a level has yet to take up; none for the emotion
        self._held = np.zeros((3, 8), dtype=bool)
        self._lost = np.zeros(8)  # share of the mood that contact took and that has not healed
        self._stale = np.zeros((len(SOURCES), 8))

    @property
    def time(self) -> float:
        """Seconds lived."""
        return self._time

    @property
    def emotion(self) -> Array:
        """The fastest level, (8,) in [0, 1]."""
        return np.array(self._levels[0])

    @property
    def feeling(self) -> Array:
        """The middle level, (8,) in [0, 1]."""
        return np.array(self._levels[1])

    @property
    def mood(self) -> Array:
        """The slowest level, (8,) in [0, 1], with what contact has taken from it."""
        mood: Array = self._levels[2] * (1 - self._lost)
        return mood

    def stimulate(self, stimulus: Stimulus) -> None:
        """Take in what happened now.

        The emotion jumps at once; feeling and mood begin to take up their shares. What is
        supported rises and what is inhibited falls by the temperament's matrix. A stimulus of the
        same feeling from the same source has less effect each time, until it is new again.
        """
        source, feeling = SOURCES.index(stimulus.source), FEELINGS.index(stimulus.feeling)
        fresh = 1 - self._stale[source, feeling]
        self._stale[source, feeling] += (
            self.temperament.habituation.share * stimulus.strength * fresh
        )
        strength = stimulus.strength * self.temperament.weights[source] * fresh
        effect = strength * self.temperament.shares * self.temperament.matrix[feeling]
        kept = 1 + np.minimum(effect, 0)
        self._levels *= kept
        self._pending *= kept
        rise = np.maximum(effect, 0) * (1 - self._levels - self._pending)
        self._levels[0] += rise[0]
        self._pending[1:] += rise[1:]

    def contact(self) -> None:
        """Lower every mood by 20 %, as the robot was touched while it moved (Section 4).

        The loss heals with the mood's own time constant; encounters compound.
        """
        self._lost = 1 - CONTACT_FACTOR * (1 - self._lost)

    def step(self, dt: float) -> None:
        """Let ``dt`` seconds pass, exactly, however many they are.

        Raises
        ------
        InputError
            ``dt`` is negative or not finite.
        """
        dt = _seconds(dt, "dt")
        fading = 1 / self.temperament.fading
        arriving = np.vstack([fading[:1], fading[:2]])  # each level at the pace of the one above
        leaving = np.where(self._held, 0.0, fading)
        apart = arriving - leaving
        # Never 0 where something is pending: each level lasts at least twice as long as the last.
        apart[0] = 1.0
        taken = -np.exp(-leaving * dt) * np.expm1(-apart * dt) * arriving / apart
        self._levels = self._levels * np.exp(-leaving * dt) + self._pending * taken
        self._pending *= np.exp(-arriving * dt)
        self._lost *= np.exp(-fading[2] * dt)
        self._stale *= np.exp(-dt / self.temperament.habituation.recovery)
        self._time += dt

    def express(self) -> Expression | None:
        """Return what the body shows: the strongest emotion, as strong as its mood (Section 4).

        Nothing (neutral) while no emotion reaches the temperament's threshold. Of equally strong
        emotions the first in the order of ``FEELINGS`` wins.
        """
        strongest = int(np.argmax(self._levels[0]))
        if self._levels[0, strongest] < max(self.temperament.threshold, np.finfo(float).tiny):
            return None
        return Expression(FEELINGS[strongest], float(self.mood[strongest]))

    def set_state(
        self,
        *,
        emotion: Mapping[str, float] | None = None,
        feeling: Mapping[str, float] | None = None,
        mood: Mapping[str, float] | None = None,
        hold: bool = False,
    ) -> None:
        """Set whole levels by hand, as the paper's experiment does (Section 5).

        Parameters
        ----------
        emotion, feeling, mood
            Values in [0, 1] by feeling; feelings that are not named become 0. A level that is not
            given stays as it is. A mood that is set has lost nothing to contact.
        hold
            The named values do not fade until their level is set again; stimuli and contact act
            on them as ever, and losses to contact heal.

        Raises
        ------
        InputError
            A feeling is unknown or a value is outside [0, 1]; nothing has changed then.
        """
        given = [None if level is None else _eight(level) for level in (emotion, feeling, mood)]
        named = (emotion, feeling, mood)
        for row, values in enumerate(given):
            if values is None:
                continue
            self._levels[row] = values
            self._pending[row] = 0
            self._held[row] = [hold and name in (named[row] or {}) for name in FEELINGS]
        if mood is not None:
            self._lost[:] = 0

    def save(self) -> dict[str, Any]:
        """Return the state as what JSON can carry, with a version."""
        return {
            "version": STATE_VERSION,
            "model": "cascade",
            "time": self._time,
            "levels": self._levels.tolist(),
            "pending": self._pending.tolist(),
            "held": self._held.tolist(),
            "lost": self._lost.tolist(),
            "stale": self._stale.tolist(),
        }

    @classmethod
    def load(
        cls, state: Mapping[str, Any], temperament: Temperament | None = None, *, away: float = 0.0
    ) -> Self:
        """Return the model that was saved, aged by the time that it was away.

        Parameters
        ----------
        state
            What :meth:`save` returned.
        temperament
            The temperament to go on with; it is not part of the state.
        away
            Seconds between saving and loading.

        Raises
        ------
        InputError
            The state is of another version or model, or a value is outside what is allowed.
        """
        if state.get("version") != STATE_VERSION or state.get("model") != "cascade":
            raise InputError(
                f"The state must have version {STATE_VERSION} and model 'cascade', got "
                f"{state.get('version')!r} and {state.get('model')!r}."
            )
        model = cls(temperament)
        model._time = float(state["time"])
        model._levels = np.array(state["levels"], dtype=float)
        model._pending = np.array(state["pending"], dtype=float)
        model._held = np.array(state["held"], dtype=bool)
        model._lost = np.array(state["lost"], dtype=float)
        model._stale = np.array(state["stale"], dtype=float)
        model.step(away)
        return model


def _eight(values: Mapping[str, float]) -> Array:
    for name in values:
        _known(name, FEELINGS, "feeling")
    return np.array([_unit(values.get(name, 0.0), name) for name in FEELINGS])


def _known(name: str, allowed: tuple[str, ...], what: str) -> None:
    if name not in allowed:
        raise InputError(f"{what} must be one of {', '.join(allowed)}, got {name!r}.")


def _unit(value: object, what: str) -> float:
    number = _number(value)
    if not 0 <= number <= 1:
        raise InputError(f"{what} must be a number from 0 to 1, got {value!r}.")
    return number


def _seconds(value: object, what: str) -> float:
    number = _number(value)
    if not 0 <= number < inf:
        raise InputError(f"{what} must be a finite number of seconds ≥ 0, got {value!r}.")
    return number


def _number(value: object) -> float:
    """Return a plain or NumPy number as float, anything else as NaN."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.number):
        return nan
    return float(value)
