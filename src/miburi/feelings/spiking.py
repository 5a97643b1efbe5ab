"""A second emotional model: three layers of spike-response neurons, one for each feeling.

Related papers on the same partner describe layers of spike-response neurons for emotion, feeling
and mood, with Hebbian weights among the feelings, and print no constants: the structure is theirs,
the exact form and all numbers are ours.

The potential of a neuron is its activation less its refractoriness (the spike-response
model of Gerstner, Ritz and van Hemmen, Biological Cybernetics 69, 1993)::

    u(t) = a e^(−t/τ) − r e^(−t/(ρ τ))

with τ the time constant of its level. A stimulus raises the activations of the emotion layer by
the temperament's matrix. Where u reaches θ the neuron fires: r rises by R, and its spike reaches
the next layer, raising the same feeling there and lowering those that it inhibits. A spike that
finds other neurons of the next layer excited strengthens the way to them (Hebb's rule); what was
learned fades in a day. Every input moves an activation towards 0 or 1, by a share of what is left,
so that the activations, which are the levels, stay in [0, 1].

Spikes only run from layer to layer, so the net falls silent by itself. Between spikes everything
decays exactly, and the next spike is the root of one equation: an hour costs its spikes.
"""

from collections.abc import Mapping
from math import exp, inf, log
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from miburi.feelings.catalogue import FEELINGS
from miburi.feelings.model import FeelingModel
from miburi.feelings.temperament import Array, Temperament

__all__ = ["SpikingModel"]

_THRESHOLD = 0.1
_RESET = 0.2  # far below 1, so that the rate of spikes grows almost evenly with the activation
_RECOVERY = 0.25  # ρ: refractoriness fades four times as fast as the activation
_SYNAPSE = 0.07  # a spike hands on this part of what the whole stimulus is meant to
_LEARNING = 0.01
_MOST_LEARNED = 0.15  # as part of the weight of the own feeling
_FORGETTING = 86_400.0  # s
_NEWTON_STEPS = 8


class SpikingModel(FeelingModel):
    """Emotion, feeling and mood as three layers of spike-response neurons.

    Parameters
    ----------
    temperament
        Time constants, shares, matrix, habituation; the default temperament if none is given.
    """

    kind = "spiking"
    _stored: ClassVar = {
        "activation": 1,
        "refractory": 1 + _RESET,
        "trace": 1,
        "learned": 1,
        "held": 1,
        "lost": 1,
        "stale": 1,
    }

    def __init__(self, temperament: Temperament | None = None) -> None:
        super().__init__(temperament)
        # State at the last spike or input ...
        n = len(FEELINGS)
        self._activation = np.zeros((3, n))
        self._refractory = np.zeros((3, n))
        self._trace = np.zeros((3, n))  # 1 at a spike, fading with the level
        self._learned = np.zeros((2, n, n))
        # ... which was `since` seconds ago, and when each neuron fires after it.
        self._since = 0.0
        self._next = np.full((3, n), inf)

    def _now(self) -> Array:
        level: Array = self._activation * np.exp(-self._leaving() * self._since)
        return level

    def _excite(self, feeling: int, strength: float) -> None:
        self._advance(self._since)
        self._receive(0, strength * self.temperament.matrix[feeling])
        self._pass(0.0)

    def _pass(self, dt: float) -> None:
        self._since += dt
        while (first := self._next.min()) <= self._since:
            layer, neuron = divmod(int(self._next.argmin()), len(FEELINGS))
            self._advance(first)
            self._fire(layer, neuron)

    def _set(self, row: int, values: Array) -> None:
        self._advance(self._since)
        self._activation[row] = values
        self._refractory[row] = 0
        self._trace[row] = 0
        self._plan(row)

    def _state(self) -> dict[str, NDArray[Any]]:
        return {**self._decayed(self._since), **super()._state()}

    def _restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        super()._restore(arrays)
        self._activation, self._refractory = arrays["activation"], arrays["refractory"]
        self._trace, self._learned = arrays["trace"], arrays["learned"]
        self._since = 0.0
        for layer in range(3):
            self._plan(layer)

    @property
    def _weights(self) -> Array:
        """Weights from each layer to the next, (2,)."""
        shares = self.temperament.shares[:, 0]
        ratio = shares[1:] / np.maximum(shares[:-1], 1e-12)
        weights: Array = _SYNAPSE * np.minimum(ratio, 1)
        return weights

    @property
    def _slow(self) -> Array:
        """Rates at which activations fade, (3, n) 1/s."""
        return 1 / self.temperament.fading

    @property
    def _fast(self) -> Array:
        """Rates at which refractoriness fades, (3, n) 1/s."""
        return self._slow / _RECOVERY

    def _leaving(self) -> Array:
        return np.where(self._held, 0.0, self._slow)

    def _decayed(self, seconds: float) -> dict[str, Array]:
        return {
            "activation": self._activation * np.exp(-self._leaving() * seconds),
            "refractory": self._refractory * np.exp(-self._fast * seconds),
            "trace": self._trace * np.exp(-self._slow * seconds),
            "learned": self._learned * np.exp(-seconds / _FORGETTING),
        }

    def _advance(self, seconds: float) -> None:
        """Move the moment to which the state belongs; no neuron may fire on the way."""
        state = self._decayed(seconds)
        self._activation, self._refractory = state["activation"], state["refractory"]
        self._trace, self._learned = state["trace"], state["learned"]
        self._since -= seconds
        self._next = np.maximum(self._next - seconds, 0.0)

    def _receive(self, layer: int, effect: Array) -> None:
        effect = np.where(self._held[layer], 0.0, effect)
        self._activation[layer] *= 1 + np.minimum(effect, 0)
        self._activation[layer] += np.maximum(effect, 0) * (1 - self._activation[layer])
        self._plan(layer)

    def _fire(self, layer: int, neuron: int) -> None:
        self._refractory[layer, neuron] += _RESET
        self._trace[layer, neuron] = 1.0
        self._plan(layer)
        if layer == 2:
            return
        innate = self.temperament.matrix[neuron]
        learned = self._learned[layer, neuron]
        # Hebb's rule, from where the spike starts to what is excited where it arrives.
        grows = np.where(innate < 0, 0.0, _LEARNING * self._trace[layer + 1])
        learned += grows * (_MOST_LEARNED - learned)
        own = np.arange(len(FEELINGS)) == neuron
        # Support acts on the emotion layer already; from layer to layer it has to be learned.
        effect = np.where(own, 1.0, np.minimum(innate, 0)) + learned
        self._receive(layer + 1, self._weights[layer] * effect)

    def _plan(self, layer: int) -> None:
        """Foresee when the neurons of a layer fire if nothing arrives before."""
        slow, fast = self._slow, self._fast
        for neuron in range(len(FEELINGS)):
            place = layer, neuron
            self._next[place] = inf
            if self._activation[place] >= _THRESHOLD and not self._held[place]:  # held is silent
                self._next[place] = _spike_time(
                    float(self._activation[place]),
                    float(self._refractory[place]),
                    float(slow[place]),
                    float(fast[place]),
                )


def _spike_time(a: float, r: float, slow: float, fast: float) -> float:
    """Return when u(t) = a e^(−slow t) − r e^(−fast t) first reaches the threshold, in s."""
    if a - r >= _THRESHOLD:
        return 0.0
    if r * fast <= a * slow:
        return inf
    # u rises to one peak and falls again.
    peak = log(r * fast / (a * slow)) / (fast - slow)
    if a * exp(-slow * peak) - r * exp(-fast * peak) <= _THRESHOLD:
        return inf
    # Up to the peak u is concave: Newton's steps from 0 approach the root from below.
    t = 0.0
    for _ in range(_NEWTON_STEPS):
        up, down = a * exp(-slow * t), r * exp(-fast * t)
        t += (_THRESHOLD - up + down) / (fast * down - slow * up)
    return t
