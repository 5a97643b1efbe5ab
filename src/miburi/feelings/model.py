"""The emotional model of Section 4: emotion, feeling and mood, on three time scales.

In go stimuli, contacts and the passing of time; out comes an :class:`Expression`, the strongest
emotion with its mood. Each of the three levels holds a number from 0 to 1 for each of the n
``FEELINGS``; the paper has eight.

The emotion follows the latest events, the feeling those of a longer time, and the mood those of
the longest. A stimulus changes the emotion at once. The feeling takes up its share while the
emotion fades, and the mood while the feeling fades::

    emotion  x' = −x/τe
    feeling  p' = −p/τe    x' = −x/τf + p/τe
    mood     p' = −p/τf    x' = −x/τm + p/τf

with x the level and p the part that it has yet to take up. Support, inhibition, habituation and
saturation act as a jump at the stimulus. Between stimuli everything is linear and integrated
exactly, so a step of an hour costs no more than a step of a millisecond. Every level stays in
[0, 1], because x + p only falls between jumps and no jump lifts it above 1.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, nan
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from miburi.errors import InputError
from miburi.feelings.catalogue import FEELINGS, PAPER
from miburi.feelings.temperament import (
    LEVELS,
    SOURCES,
    Array,
    Temperament,
    shipped_temperament,
)

__all__ = ["CONTACT_FACTOR", "FEELINGS", "LEVELS", "SOURCES"]
__all__ += ["EmotionalModel", "Expression", "FeelingModel", "Stimulus"]

#: Factor by which a contact lowers every mood (Section 4: decreased by 20 %).
CONTACT_FACTOR = 0.8
STATE_VERSION = 1


@dataclass(frozen=True)
class Stimulus:
    """An event that the partner feels: somebody said, showed or did something.

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
        _check_name(self.feeling, FEELINGS, "feeling")
        _check_name(self.source, SOURCES, "source")
        object.__setattr__(self, "strength", _unit(self.strength, "strength"))


@dataclass(frozen=True)
class Expression:
    """What the body shows: a feeling, with its mood as the intensity μ in [0, 1]."""

    feeling: str
    mood: float

    def __post_init__(self) -> None:
        _check_name(self.feeling, FEELINGS, "feeling")
        object.__setattr__(self, "mood", _unit(self.mood, "mood"))


class FeelingModel(ABC):
    """The interface of every emotional model; subclasses say how the levels change.

    Parameters
    ----------
    temperament
        All constants; the default temperament if none is given.
    """

    #: The name of the model in a saved state.
    kind: ClassVar[str]
    #: The names of the arrays in a saved state, and the largest value allowed in each.
    _limits: ClassVar[dict[str, float]]

    def __init__(self, temperament: Temperament | None = None) -> None:
        self._temperament = temperament or shipped_temperament()
        self._time = 0.0
        n = len(FEELINGS)
        self._held = np.zeros((3, n), dtype=bool)
        self._lost = np.zeros(n)  # share of the mood that contact took and that has not healed
        self._stale = np.zeros((len(SOURCES), n))

    @property
    def temperament(self) -> Temperament:
        """All constants; a new temperament acts from the moment it is assigned."""
        return self._temperament

    @temperament.setter
    def temperament(self, temperament: Temperament) -> None:
        state = self._state()  # at this moment, by the old constants
        self._temperament = temperament
        self._restore(state)

    @property
    def time(self) -> float:
        """Age of the model, s."""
        return self._time

    @property
    def emotion(self) -> Array:
        """The fastest level, (n,) in [0, 1]."""
        return np.array(self._current_levels()[0])

    @property
    def feeling(self) -> Array:
        """The middle level, (n,) in [0, 1]."""
        return np.array(self._current_levels()[1])

    @property
    def mood(self) -> Array:
        """The slowest level, (n,) in [0, 1], lowered by contacts."""
        return np.array(self._current_levels()[2] * (1 - self._lost))

    def stimulate(self, stimulus: Stimulus) -> None:
        """Let a stimulus act now.

        The emotion jumps at once. By the temperament's matrix, the feelings that it supports rise
        and those that it inhibits fall. Each repetition from the same source has less effect,
        until the stimulus is new again.
        """
        source, feeling = SOURCES.index(stimulus.source), FEELINGS.index(stimulus.feeling)
        fresh = 1 - self._stale[source, feeling]
        self._stale[source, feeling] += (
            self.temperament.habituation.share * stimulus.strength * fresh
        )
        self._excite(feeling, stimulus.strength * self.temperament.weights[source] * fresh)

    def contact(self) -> None:
        """Lower every mood by 20 %, because the robot met something while it moved (Section 4).

        The losses of several contacts multiply. They heal with the time constant of the mood.
        """
        self._lost = 1 - CONTACT_FACTOR * (1 - self._lost)

    def step(self, dt: float) -> None:
        """Let ``dt`` seconds pass; the result is exact for any length.

        Raises
        ------
        InputError
            ``dt`` is negative or not finite.
        """
        dt = _seconds(dt, "dt")
        self._pass(dt)
        self._lost *= np.exp(-dt / self.temperament.fading[2])
        self._stale *= np.exp(-dt / self.temperament.habituation.recovery)
        self._time += dt

    def express(self) -> Expression | None:
        """Return what the body shows: the strongest emotion, with its mood (Section 4).

        The result is None (neutral) while no emotion reaches the temperament's threshold. Of
        equally strong emotions the first in the order of ``FEELINGS`` wins.
        """
        emotion = self.emotion
        strongest = int(np.argmax(emotion))
        if emotion[strongest] < self.temperament.threshold:
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
            Values in [0, 1] by feeling. Feelings that are not named become 0, and a level that is
            not given stays as it is. Setting the mood also undoes its losses by contacts.
        hold
            Keep the named values until their level is set again. Only a contact lowers a held
            mood, and that loss heals.

        Raises
        ------
        InputError
            A feeling is unknown or a value is outside [0, 1]. Then nothing changes.
        """
        levels = (emotion, feeling, mood)
        values = [None if level is None else _row(level) for level in levels]
        for row, (level, value) in enumerate(zip(levels, values, strict=True)):
            if level is not None and value is not None:
                self._held[row] = [hold and name in level for name in FEELINGS]
                self._set(row, value)
        if mood is not None:
            self._lost[:] = 0

    def save(self) -> dict[str, Any]:
        """Return the state, with a version, ready for JSON."""
        state = {name: array.tolist() for name, array in self._state().items()}
        return {
            "version": STATE_VERSION,
            "model": self.kind,
            "feelings": list(FEELINGS),
            "time": self._time,
            **state,
        }

    @classmethod
    def load(
        cls, state: Mapping[str, Any], temperament: Temperament | None = None, *, away: float = 0.0
    ) -> Self:
        """Return a saved model, aged by the time since it was saved.

        Parameters
        ----------
        state
            What :meth:`save` returned.
        temperament
            The temperament of the model; the state does not contain one.
        away
            Seconds between saving and loading.

        Raises
        ------
        InputError
            The state is of another version, model or set of feelings, or a value is missing or
            not allowed.
        """
        header = tuple(state.get(key) for key in ("version", "model"))
        if header != (STATE_VERSION, cls.kind):
            raise InputError(
                f"The state must have version {STATE_VERSION} and model {cls.kind!r}, got "
                f"{header[0]!r} and {header[1]!r}; without a state the model starts afresh."
            )
        names = state.get("feelings", list(PAPER))  # older states name none
        if names != list(FEELINGS):
            raise InputError(
                f"The state must be of the feelings {', '.join(FEELINGS)}, got {names!r:.200}; "
                "load it with the file of feelings that it was saved with (MIBURI_FEELINGS)."
            )
        model = cls(temperament)
        model._time = _seconds(state.get("time"), "the state's time")
        model._restore(
            {
                name: _read_array(state.get(name), array, model._limits[name], name)
                for name, array in model._state().items()
            }
        )
        model.step(away)
        return model

    @abstractmethod
    def _current_levels(self) -> Array:
        """Return the three levels, (3, n) in [0, 1], without the losses by contacts."""

    @abstractmethod
    def _excite(self, feeling: int, strength: float) -> None:
        """Let a stimulus act, with its strength after source and habituation."""

    @abstractmethod
    def _pass(self, dt: float) -> None:
        """Advance the levels by ``dt`` seconds."""

    @abstractmethod
    def _set(self, row: int, values: Array) -> None:
        """Set one level, and drop what it has yet to take up."""

    def _state(self) -> dict[str, NDArray[Any]]:
        """Return the arrays of the state, with the names in ``_limits``."""
        return {"held": self._held, "lost": self._lost, "stale": self._stale}

    def _restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Restore the arrays that :meth:`_state` returned."""
        self._held, self._lost, self._stale = (arrays[name] for name in ("held", "lost", "stale"))


class EmotionalModel(FeelingModel):
    """Emotion, feeling and mood as a linear cascade between stimuli.

    Parameters
    ----------
    temperament
        All constants; the default temperament if none is given.

    Examples
    --------
    >>> model = EmotionalModel()
    >>> model.stimulate(Stimulus("happiness", 0.8, "speech"))
    >>> model.express()
    Expression(feeling='happiness', mood=0.0)
    """

    kind = "cascade"
    _limits: ClassVar = {"levels": 1, "pending": 1, "held": 1, "lost": 1, "stale": 1}

    def __init__(self, temperament: Temperament | None = None) -> None:
        super().__init__(temperament)
        self._levels = np.zeros((3, len(FEELINGS)))
        # The part that each level has yet to take up; 0 for the emotion.
        self._pending = np.zeros((3, len(FEELINGS)))

    def _current_levels(self) -> Array:
        return self._levels

    def _excite(self, feeling: int, strength: float) -> None:
        effect = strength * self.temperament.shares * self.temperament.matrix[feeling]
        effect = np.where(self._held, 0.0, effect)
        remaining = 1 + np.minimum(effect, 0)
        self._levels *= remaining
        self._pending *= remaining
        rise = np.maximum(effect, 0) * (1 - self._levels - self._pending)
        self._levels[0] += rise[0]
        self._pending[1:] += rise[1:]

    def _pass(self, dt: float) -> None:
        leaving = 1 / self.temperament.fading
        # Each level takes up at the rate at which the one before it fades. It lasts at least twice
        # as long, so that ``apart`` is above 0.
        arriving = np.vstack([leaving[:1], leaving[:2]])
        leaving = np.where(self._held, 0.0, leaving)
        apart = arriving - leaving
        apart[0] = 1.0  # nothing is pending for the emotion
        uptake = -np.exp(-leaving * dt) * np.expm1(-apart * dt) * arriving / apart
        levels = self._levels * np.exp(-leaving * dt) + self._pending * uptake
        self._levels = np.minimum(levels, 1.0)  # only against rounding
        self._pending *= np.exp(-arriving * dt)

    def _set(self, row: int, values: Array) -> None:
        self._levels[row] = values
        self._pending[row] = 0

    def _state(self) -> dict[str, NDArray[Any]]:
        return {"levels": self._levels, "pending": self._pending, **super()._state()}

    def _restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        super()._restore(arrays)
        self._levels, self._pending = arrays["levels"], arrays["pending"]
        if np.any(self._levels + self._pending > 1 + 1e-9):
            raise InputError("The state's levels and pending must not exceed 1 together.")


def _read_array(values: object, like: NDArray[Any], largest: float, name: str) -> NDArray[Any]:
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError):
        array = np.array(nan)
    if array.shape != like.shape or not np.all((array >= 0) & (array <= largest)):
        raise InputError(
            f"The state's {name} must be numbers from 0 to {largest} in the shape {like.shape}, "
            f"got {values!r:.80}."
        )
    return array.astype(like.dtype)


def _row(values: Mapping[str, float]) -> Array:
    for name in values:
        _check_name(name, FEELINGS, "feeling")
    return np.array([_unit(values.get(name, 0.0), name) for name in FEELINGS])


def _check_name(name: str, allowed: tuple[str, ...], what: str) -> None:
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
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        return nan
    return float(value)
