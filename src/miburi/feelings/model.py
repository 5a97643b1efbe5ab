"""The emotional model of Section 4: emotion, feeling and mood, on three time scales.

A model takes stimuli, contacts and the passing of time, and returns an :class:`Expression`: the
strongest emotion, and the mood of that feeling. Each of the three levels holds a number from 0 to 1
for each of the n ``FEELINGS``; the paper has eight. How the levels change is left to subclasses;
the subclass in use is :class:`miburi.feelings.cascade.EmotionalModel`.

The mood that is shown is m + (1 − m) x − d, with x the slowest level, m the temperament's resting
mood, shifted for the person who is with the partner, and d the mood lost to contacts and
inhibition. d fades with the mood's time constant, so every mood goes back to rest.
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
__all__ += ["Expression", "FeelingModel", "Stimulus"]

#: Factor by which a contact lowers every mood (Section 4: decreased by 20 %).
CONTACT_FACTOR = 0.8
STATE_VERSION = 2
_MOST_REST = 0.9  # the largest resting mood that a temperament may have


@dataclass(frozen=True)
class Stimulus:
    """An event that the partner feels: somebody said, showed or did something.

    Parameters
    ----------
    feeling
        One of ``FEELINGS``.
    strength
        From 0 to 1.
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
    """What the body shows.

    Attributes
    ----------
    feeling
        One of ``FEELINGS``.
    mood
        The mood of that feeling, in [0, 1]; it is the intensity μ of the gesture.
    """

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
    _limits: ClassVar[dict[str, float]] = {"held": 1, "mood": 1, "stale": 1}

    def __init__(self, temperament: Temperament | None = None) -> None:
        self._temperament = temperament or shipped_temperament()
        self._time = 0.0
        n = len(FEELINGS)
        self._held = np.zeros((3, n), dtype=bool)
        self._lowered = np.zeros(n)  # mood lost to contacts and inhibition, and not yet healed
        self._leaning = np.zeros(n)  # the person's shift of the resting mood
        self._stale = np.zeros((len(SOURCES), n))
        self._find_rest()

    @property
    def temperament(self) -> Temperament:
        """All constants; a new temperament acts from the moment it is assigned."""
        return self._temperament

    @temperament.setter
    def temperament(self, temperament: Temperament) -> None:
        state = self._state()  # the levels at this moment, computed with the old constants
        self._temperament = temperament
        self._restore(state)

    def lean(self, leaning: Array | None) -> None:
        """Shift the temperament's resting moods for a person, by feeling; None ends the shift.

        The shown mood does not jump; from now on it moves towards its new rest.
        """
        state = self._state()
        self._leaning = np.zeros(len(FEELINGS)) if leaning is None else np.array(leaning)
        self._restore(state)

    @property
    def time(self) -> float:
        """The model's age, in s."""
        return self._time

    @property
    def emotion(self) -> Array:
        """The fastest level: for each feeling a value in [0, 1]."""
        return np.array(self._current_levels()[0])

    @property
    def feeling(self) -> Array:
        """The middle level: for each feeling a value in [0, 1]."""
        return np.array(self._current_levels()[1])

    @property
    def mood(self) -> Array:
        """The slowest level, with values in [0, 1]; it comes to rest at the temperament's mood."""
        return (self._risen_mood() - self._lowered).clip(0, 1)

    def stimulate(self, stimulus: Stimulus) -> None:
        """Let a stimulus act now.

        The emotion jumps at once. The temperament's matrix says which other feelings rise
        or fall with the feeling of the stimulus. Each repetition from the same source has
        less effect, until the stimulus is new again.
        """
        source, feeling = SOURCES.index(stimulus.source), FEELINGS.index(stimulus.feeling)
        fresh = 1 - self._stale[source, feeling]
        self._stale[source, feeling] += (
            self.temperament.habituation.share * stimulus.strength * fresh
        )
        self._excite(feeling, stimulus.strength * self.temperament.weights[source] * fresh)

    def contact(self) -> None:
        """Lower every mood by 20 %, because the robot met something while it moved (Section 4).

        The losses of several contacts multiply. The lost mood returns with the time constant
        of the mood; the effect of later stimuli is not reduced.
        """
        self._lowered += (1 - CONTACT_FACTOR) * self.mood

    def step(self, dt: float) -> None:
        """Let ``dt`` seconds pass; the result is exact for any length.

        Raises
        ------
        InputError
            ``dt`` is negative or not finite.
        """
        dt = _seconds(dt, "dt")
        self._pass(dt)
        self._stale *= np.exp(-dt / self.temperament.habituation.recovery)
        self._time += dt

    def express(self) -> Expression | None:
        """Return what the body shows: the strongest emotion, with its mood (Section 4).

        The result is None (neutral) while no emotion reaches the temperament's threshold. Of
        equally strong emotions the first in the order of ``FEELINGS`` wins.
        """
        emotion = self._current_levels()[0]
        strongest = int(emotion.argmax())
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
            Values in [0, 1] by feeling. Feelings that are not named become 0; a level that is not
            given stays as it is. If a level rises, the slower levels follow as they would after a
            stimulus that caused this rise.
        hold
            Keep the named values until their level is set again. The slower levels follow a held
            level. Only a contact lowers a held mood, and that loss heals.

        Raises
        ------
        InputError
            A feeling is unknown or a value is outside [0, 1]. Then nothing changes.
        """
        levels = (emotion, feeling, mood)
        values = [None if level is None else _row(level) for level in levels]
        # The slowest level is set first. Setting a level discards the pending effect of earlier
        # stimuli on it, so the effect of setting a faster level must be added afterwards.
        for row in (2, 1, 0):
            level, value = levels[row], values[row]
            if level is not None and value is not None:
                self._held[row] = [hold and name in level for name in FEELINGS]
                if row == 2:
                    self._find_rest()
                    rest = self._rest
                    self._set(row, np.maximum(value - rest, 0) / (1 - rest))
                    self._lowered = self._risen_mood() - value
                else:
                    self._set(row, value)

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
        """Return a saved model, aged by ``away`` seconds, the time since :meth:`save` was called.

        The state does not contain a temperament.

        Raises
        ------
        InputError
            The state is no mapping, or of another version, model or set of feelings, or a value is
            missing or not allowed.
        """
        if not isinstance(state, Mapping):
            raise InputError(f"The state must be a dict, as save() returns it; got {state!r:.80}.")
        header = tuple(state.get(key) for key in ("version", "model"))
        if header != (STATE_VERSION, cls.kind):
            raise InputError(
                f"The state must have version {STATE_VERSION} and model {cls.kind!r}, got "
                f"{header[0]!r} and {header[1]!r}. Without a state the model starts afresh."
            )
        names = state.get("feelings", list(PAPER))  # older states do not name their feelings
        if names != list(FEELINGS):
            raise InputError(
                f"The state must be for the feelings {', '.join(FEELINGS)}, got {names!r:.200}. "
                "Load it with the feelings file that it was saved with (MIBURI_FEELINGS)."
            )
        model = cls(temperament)
        model._time = _seconds(state.get("time"), "the state's time")
        saved = dict(state)
        if isinstance(stale := state.get("stale"), list) and len(stale) == len(SOURCES) - 1:
            saved["stale"] = [
                *stale,
                [0.0] * len(FEELINGS),
            ]  # older states have no values for the source "talk"
        model._restore(
            {
                name: _read_array(saved.get(name), array, model._limits[name], name)
                for name, array in model._state().items()
            }
        )
        model.step(away)
        return model

    def _find_rest(self) -> None:
        """Find the resting moods, to which the slowest level is added; a held mood rests at 0."""
        rest = np.clip(self.temperament.rest + self._leaning, 0.0, _MOST_REST)
        self._rest: Array = np.where(self._held[2], 0.0, rest)

    def _risen_mood(self) -> Array:
        """Return the mood as it would be if contact and inhibition had taken nothing."""
        mood: Array = self._rest + (1 - self._rest) * self._current_levels()[2]
        return mood

    def _heal(self, dt: float) -> None:
        self._lowered *= np.exp(-dt / self.temperament.fading[2])

    def _inhibit_mood(self, remaining: Array) -> None:
        """Multiply each shown mood by its share; subclasses also scale their slowest level."""
        sunk = remaining * self._lowered + (1 - remaining) * self._rest
        self._lowered = np.where(self._held[2], self._lowered, sunk)

    @abstractmethod
    def _current_levels(self) -> Array:
        """Return the levels as an array (3, n) in [0, 1]; the slowest is relative to its rest."""

    @abstractmethod
    def _excite(self, feeling: int, strength: float) -> None:
        """Apply a stimulus, whose strength is already scaled for its source and for habituation."""

    @abstractmethod
    def _pass(self, dt: float) -> None:
        """Advance the levels by ``dt`` seconds, and heal the mood."""

    @abstractmethod
    def _set(self, row: int, values: Array) -> None:
        """Set one level, drop its pending part, and pass a rise on to the slower levels."""

    def _state(self) -> dict[str, NDArray[Any]]:
        """Return the arrays of the state, with the names in ``_limits``."""
        return {"held": self._held, "mood": self.mood, "stale": self._stale}

    def _restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Restore the arrays that :meth:`_state` returned; a subclass first restores its own."""
        self._held, self._stale = arrays["held"], arrays["stale"]
        self._find_rest()
        self._lowered = self._risen_mood() - arrays["mood"]


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
