"""Emotion, feeling and mood as a linear cascade between stimuli: the model in use.

The emotion follows the latest events, the feeling follows events over a longer time, and the mood
over the longest. A stimulus changes the emotion at once. While the emotion fades, the feeling takes
up a share of it; while the feeling fades, the mood takes up a share of the feeling::

    emotion  x' = −x/τe
    feeling  p' = −p/τe + a h/τe (1 − x − p)    x' = −x/τf + p/τe
    mood     p' = −p/τf + b h/τe (1 − x − p)    x' = −x/τm + p/τf

Here x is the level, p the part that the level has yet to take up, and a and b are the temperament's
shares. h is the level at which an emotion is held (``set_state``), or 0: the emotion is topped up
as it fades, and each top-up acts on the slower levels like a stimulus. Support, inhibition,
habituation and saturation are applied at once when a stimulus arrives. Between stimuli everything
is linear and integrated exactly, so a step of an hour costs no more than a step of a millisecond.
Every level stays in [0, 1], because x + p never exceeds 1.
"""

from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from miburi.errors import InputError
from miburi.feelings.model import FEELINGS, FeelingModel
from miburi.feelings.temperament import Array, Temperament


class EmotionalModel(FeelingModel):
    """Emotion, feeling and mood as a linear cascade between stimuli.

    Examples
    --------
    >>> from miburi.feelings import Stimulus
    >>> model = EmotionalModel()
    >>> model.stimulate(Stimulus("happiness", 0.8, "speech"))
    >>> model.express()
    Expression(feeling='happiness', mood=0.5)
    """

    kind = "cascade"
    _limits: ClassVar = {"levels": 1, "pending": 1, **FeelingModel._limits}

    def __init__(self, temperament: Temperament | None = None) -> None:
        super().__init__(temperament)
        self._levels = np.zeros((3, len(FEELINGS)))
        # The part that each level has yet to take up; 0 for the emotion.
        self._pending = np.zeros((3, len(FEELINGS)))
        # The latest change and its length in s, kept because most steps are equally long.
        self._latest: tuple[float, _Change] | None = None

    def __getstate__(self) -> dict[str, Any]:
        return vars(self) | {"_latest": None}  # a function, which cannot be pickled

    def _current_levels(self) -> Array:
        return self._levels

    def _excite(self, feeling: int, strength: float) -> None:
        effect = strength * self.temperament.shares * self.temperament.matrix[feeling]
        effect = np.where(self._held, 0.0, effect)
        remaining = 1 + np.minimum(effect, 0)
        self._levels *= remaining
        self._pending *= remaining
        self._inhibit_mood(remaining[2])
        rise = np.maximum(effect, 0)
        self._levels[0] += rise[0] * (1 - self._levels[0])
        self._pass_on(rise[1:])

    def _pass_on(self, rise: Array) -> None:
        """Add shares of a rise, shape (2, n), to what feeling and mood have still to take up."""
        room = 1 - self._levels[1:] - self._pending[1:]
        self._pending[1:] += np.where(self._held[1:], 0.0, rise) * room

    def _pass(self, dt: float) -> None:
        self._heal(dt)
        if self._latest is None or self._latest[0] != dt:
            self._latest = dt, _change(self.temperament.rates, self._supply(), dt)
        levels, self._pending[1:] = self._latest[1](self._levels, self._pending[1:])
        self._levels = np.where(self._held, self._levels, levels)

    def _supply(self) -> Array:
        """Return the rates, 1/s, at which held levels raise feeling and mood, (2, n)."""
        refill = np.where(self._held, self._levels / self.temperament.fading, 0.0)
        supply: Array = self.temperament.shares[1:] * refill[0]
        supply[1] = np.where(self._held[1], self._mood_of_feeling * refill[1], supply[1])
        supply[self._held[1:]] = 0
        return supply

    @property
    def _mood_of_feeling(self) -> float:
        """The share of a feeling that the mood takes up."""
        feeling, mood = self.temperament.shares[1:, 0]
        return float(mood / feeling) if feeling else 0.0

    def _set(self, row: int, values: Array) -> None:
        rise = np.maximum(values - self._levels[row], 0)
        self._latest = None
        self._levels[row] = values
        self._pending[row] = 0
        if row == 0:
            self._pass_on(self.temperament.shares[1:] * rise)
        elif row == 1:
            self._pass_on(np.stack([np.zeros_like(rise), self._mood_of_feeling * rise]))

    def _state(self) -> dict[str, NDArray[Any]]:
        return {"levels": self._levels, "pending": self._pending, **super()._state()}

    def _restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        self._levels, self._pending, self._latest = arrays["levels"], arrays["pending"], None
        super()._restore(arrays)
        if np.any(self._levels + self._pending > 1 + 1e-9):
            raise InputError("The state's level plus its pending part must not exceed 1.")


#: Takes the levels, (3, n), and the pending parts of the two slower levels, (2, n). Returns the
#: levels and the pending parts after a time step.
_Change = Callable[[Array, Array], tuple[Array, Array]]


def _change(rates: Array, supply: Array, dt: float) -> _Change:
    """Return the exact change in ``dt`` seconds, from the fading rates, (3, n), and the supply.

    The equations are p' = s (1 − x − p) − αp and x' = αp − βx, where s is the supply, (2, n), α the
    rate of arriving and β the rate of leaving, in 1/s. Let y be the distance of p and x from their
    equilibrium. Then y(t) = e^(λ₂t) y + φ (A − λ₂) y, with φ = (e^(λ₁t) − e^(λ₂t)) / (λ₁ − λ₂),
    where λ₁ and λ₂ are the eigenvalues of the equations' matrix A.
    """
    arriving, leaving = rates[:2], rates[1:]
    rest_level = supply / (leaving + supply + supply * leaving / arriving)
    rest_pending = leaving / arriving * rest_level
    middle = -(supply + arriving + leaving) / 2
    root = (middle + leaving) ** 2 - supply * arriving
    half = np.sqrt(root + (0j if supply.any() else 0.0))
    slow, fast = middle + half, middle - half
    apart = np.where(half == 0, 1e-300, 2 * half)
    faded, kept = np.exp(-rates[0] * dt), np.exp(fast * dt)
    # φ is written with the slow eigenvalue, so that it stays finite when the two are far apart.
    phi = -np.exp(slow * dt) * np.expm1(-apart * dt) / apart
    # The diagonal of A − λ₂: for the pending part, and for the level.
    staying, staying_level = -supply - arriving - fast, -leaving - fast

    def take(levels: Array, pending: Array) -> tuple[Array, Array]:
        p, x = pending - rest_pending, levels[1:] - rest_level
        p, x = (
            kept * p + phi * (staying * p - supply * x),
            kept * x + phi * (arriving * p + staying_level * x),
        )
        # Clipping removes rounding errors only.
        later = (x.real + rest_level).clip(0, 1)
        return np.vstack([levels[:1] * faded, later]), (p.real + rest_pending).clip(0, 1)

    return take
