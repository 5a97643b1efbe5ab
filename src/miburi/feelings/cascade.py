"""Emotion, feeling and mood as a linear cascade between stimuli: the model in use.

The emotion follows the latest events, the feeling follows events over a longer time, and the mood
follows them over the longest. A stimulus changes the emotion at once. The feeling takes up its
share while the emotion fades; the mood takes up its share while the feeling fades::

    emotion  x' = −x/τe
    feeling  p' = −p/τe + a h/τe (1 − x − p)    x' = −x/τf + p/τe
    mood     p' = −p/τf + b h/τe (1 − x − p)    x' = −x/τm + p/τf

with x the level, p the part that it has yet to take up, a and b the temperament's shares, and h an
emotion that is held (else 0): it is refilled as it fades, and a refill acts on the slower levels
like a stimulus. Support, inhibition, habituation and saturation act as a jump at the stimulus.
Between stimuli everything is linear and integrated exactly, so a step of an hour costs no more
than a step of a millisecond. x + p never exceeds 1, so every level stays in [0, 1].
"""

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from miburi.errors import InputError
from miburi.feelings.model import FEELINGS, FeelingModel
from miburi.feelings.temperament import Array, Temperament

__all__ = ["EmotionalModel"]


class EmotionalModel(FeelingModel):
    """Emotion, feeling and mood as a linear cascade between stimuli.

    Parameters
    ----------
    temperament
        All constants; the default temperament if none is given.

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
        """Add shares, (2, n), to what feeling and mood have yet to take up."""
        room = 1 - self._levels[1:] - self._pending[1:]
        self._pending[1:] += np.where(self._held[1:], 0.0, rise) * room

    def _pass(self, dt: float) -> None:
        self._heal(dt)
        rates = 1 / self.temperament.fading
        pending, levels = _take_up(
            self._pending[1:], self._levels[1:], self._supply(), rates[:2], rates[1:], dt
        )
        self._pending[1:] = pending
        levels = np.vstack([self._levels[:1] * np.exp(-rates[:1] * dt), levels])
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
        self._levels[row] = values
        self._pending[row] = 0
        if row == 0:
            self._pass_on(self.temperament.shares[1:] * rise)
        elif row == 1:
            self._pass_on(np.stack([np.zeros_like(rise), self._mood_of_feeling * rise]))

    def _state(self) -> dict[str, NDArray[Any]]:
        return {"levels": self._levels, "pending": self._pending, **super()._state()}

    def _restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        self._levels, self._pending = arrays["levels"], arrays["pending"]
        super()._restore(arrays)
        if np.any(self._levels + self._pending > 1 + 1e-9):
            raise InputError("The state's levels and pending must not exceed 1 together.")


def _take_up(
    pending: Array, level: Array, supply: Array, arriving: Array, leaving: Array, dt: float
) -> tuple[Array, Array]:
    """Let a level take up what is pending; return both after ``dt`` seconds, exactly.

    The equations are p' = s (1 − x − p) − αp and x' = αp − βx, with s the supply, α the rate of
    arriving and β that of leaving, each (2, n) 1/s. With y the distance from where both come to
    rest, y(t) = e^(λ₂t) y + φ (A − λ₂) y, φ = (e^(λ₁t) − e^(λ₂t)) / (λ₁ − λ₂), where λ₁ and λ₂ are
    the eigenvalues of the matrix A.
    """
    rest_level = supply / (leaving + supply + supply * leaving / arriving)
    rest_pending = leaving / arriving * rest_level
    p, x = pending - rest_pending, level - rest_level
    middle = -(supply + arriving + leaving) / 2
    half = np.sqrt((middle + leaving) ** 2 - supply * arriving + (0j if supply.any() else 0.0))
    slow, fast = middle + half, middle - half
    apart = np.where(half == 0, 1e-300, 2 * half)
    # Written with the slow eigenvalue, so that it stays finite when the two are far apart.
    phi = -np.exp(slow * dt) * np.expm1(-apart * dt) / apart
    kept = np.exp(fast * dt)
    p, x = (
        kept * p + phi * ((-supply - arriving - fast) * p - supply * x),
        kept * x + phi * (arriving * p + (-leaving - fast) * x),
    )
    # Clipping removes rounding errors only.
    return np.clip(p.real + rest_pending, 0, 1), np.clip(x.real + rest_level, 0, 1)
