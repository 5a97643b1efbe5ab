"""The emotional model: emotion, feeling and mood, on three time scales.

Each of the three holds a number from 0 to 1 for each of the n ``FEELINGS``; the paper has eight.

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


class FeelingModel(ABC):
    """What every emotional model is to a partner, whatever moves its levels inside.

    Parameters
    ----------
    temperament
        All constants; the default temperament if none is given.
    """

    #: The name of the model in a saved state.
    kind: ClassVar[str]
    #: The arrays of a saved state, and the largest value that each may hold.
    _stored: ClassVar[dict[str, float]]

    def __init__(self, temperament: Temperament | None = None) -> None:
        self._temperament = temperament or shipped_temperament()
        self._time = 0.0
        n = len(FEELINGS)
        self._held = np.zeros((3, n), dtype=bool)
        self._lost = np.zeros(n)  # share of the mood that contact took and that has not healed
        self._stale = np.zeros((len(SOURCES), n))

    @property
    def temperament(self) -> Temperament:
        """All constants; another one acts from the moment it is assigned."""
        return self._temperament

    @temperament.setter
    def temperament(self, temperament: Temperament) -> None:
        state = self._state()  # as the constants until now have made it
        self._temperament = temperament
        self._restore(state)

    @property
    def time(self) -> float:
        """Seconds lived."""
        return self._time

    @property
    def emotion(self) -> Array:
        """The fastest level, (n,) in [0, 1]."""
        return np.array(self._now()[0])

    @property
    def feeling(self) -> Array:
        """The middle level, (n,) in [0, 1]."""
        return np.array(self._now()[1])

    @property
    def mood(self) -> Array:
        """The slowest level, (n,) in [0, 1], with what contact has taken from it."""
        return np.array(self._now()[2] * (1 - self._lost))

    def stimulate(self, stimulus: Stimulus) -> None:
        """Take in what happened now.

        The emotion jumps at once. What is supported rises and what is inhibited falls by the
        temperament's matrix. A stimulus of the same feeling from the same source has less effect
        each time, until it is new again.
        """
        source, feeling = SOURCES.index(stimulus.source), FEELINGS.index(stimulus.feeling)
        fresh = 1 - self._stale[source, feeling]
        self._stale[source, feeling] += (
            self.temperament.habituation.share * stimulus.strength * fresh
        )
        self._excite(feeling, stimulus.strength * self.temperament.weights[source] * fresh)

    def contact(self) -> None:
        """Lower every mood by 20 %, as the robot met something while it moved (Section 4).

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
        self._pass(dt)
        self._lost *= np.exp(-dt / self.temperament.fading[2])
        self._stale *= np.exp(-dt / self.temperament.habituation.recovery)
        self._time += dt

    def express(self) -> Expression | None:
        """Return what the body shows: the strongest emotion, as strong as its mood (Section 4).

        Nothing (neutral) while no emotion reaches the temperament's threshold. Of equally strong
        emotions the first in the order of ``FEELINGS`` wins.
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
            Values in [0, 1] by feeling; feelings that are not named become 0. A level that is not
            given stays as it is. A mood that is set has lost nothing to contact.
        hold
            The named values stay, whatever happens, until their level is set again; only contact
            lowers a held mood, and that loss heals.

        Raises
        ------
        InputError
            A feeling is unknown or a value is outside [0, 1]; nothing has changed then.
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
        """Return the state as what JSON can carry, with a version."""
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
            The state is of another version or model, or of other feelings, or a value is missing
            or outside what is allowed.
        """
        found = tuple(state.get(key) for key in ("version", "model"))
        if found != (STATE_VERSION, cls.kind):
            raise InputError(
                f"The state must have version {STATE_VERSION} and model {cls.kind!r}, got "
                f"{found[0]!r} and {found[1]!r}; without it the model starts afresh."
            )
        names = state.get("feelings", list(PAPER))  # none were kept while there were only these
        if names != list(FEELINGS):
            raise InputError(
                f"The state must be of the feelings {', '.join(FEELINGS)}, got {names!r:.200}; "
                "load it with the file of feelings that it was saved with (MIBURI_FEELINGS)."
            )
        model = cls(temperament)
        model._time = _seconds(state.get("time"), "the state's time")
        model._restore(
            {
                name: _stored_array(state.get(name), array, model._stored[name], name)
                for name, array in model._state().items()
            }
        )
        model.step(away)
        return model

    @abstractmethod
    def _now(self) -> Array:
        """Return the three levels, (3, n) in [0, 1], without what contact took."""

    @abstractmethod
    def _excite(self, feeling: int, strength: float) -> None:
        """Let a stimulus of weighed strength act."""

    @abstractmethod
    def _pass(self, dt: float) -> None:
        """Let the levels run for ``dt`` seconds."""

    @abstractmethod
    def _set(self, row: int, values: Array) -> None:
        """Set one level; what was on its way to it is dropped."""

    def _state(self) -> dict[str, NDArray[Any]]:
        """Return the arrays of the state, by the names of ``_stored``."""
        return {"held": self._held, "lost": self._lost, "stale": self._stale}

    def _restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Take over arrays that :meth:`_state` once returned."""
        self._held, self._lost, self._stale = (arrays[name] for name in ("held", "lost", "stale"))


class EmotionalModel(FeelingModel):
    """Emotion, feeling and mood as linear cascades between stimuli.

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
    _stored: ClassVar = {"levels": 1, "pending": 1, "held": 1, "lost": 1, "stale": 1}

    def __init__(self, temperament: Temperament | None = None) -> None:
        super().__init__(temperament)
        self._levels = np.zeros((3, len(FEELINGS)))
        self._pending = np.zeros(
            (3, len(FEELINGS))
        )  # what a level has yet to take up; none for the emotion

    def _now(self) -> Array:
        return self._levels

    def _excite(self, feeling: int, strength: float) -> None:
        effect = strength * self.temperament.shares * self.temperament.matrix[feeling]
        effect = np.where(self._held, 0.0, effect)
        kept = 1 + np.minimum(effect, 0)
        self._levels *= kept
        self._pending *= kept
        rise = np.maximum(effect, 0) * (1 - self._levels - self._pending)
        self._levels[0] += rise[0]
        self._pending[1:] += rise[1:]

    def _pass(self, dt: float) -> None:
        leaving = 1 / self.temperament.fading
        arriving = np.vstack([leaving[:1], leaving[:2]])  # each level at the pace of the last
        leaving = np.where(self._held, 0.0, leaving)
        apart = arriving - leaving  # above 0: each level lasts at least twice as long as the last
        apart[0] = 1.0  # nothing is pending for the emotion
        taken = -np.exp(-leaving * dt) * np.expm1(-apart * dt) * arriving / apart
        levels = self._levels * np.exp(-leaving * dt) + self._pending * taken
        self._levels = np.minimum(levels, 1.0)  # against rounding only
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


def _stored_array(values: object, like: NDArray[Any], largest: float, name: str) -> NDArray[Any]:
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
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        return nan
    return float(value)
