"""A second emotional model, with the same interface: three layers of spike-response neurons.

Emotion, feeling and mood are one layer each, with one neuron per kind of feeling. Related papers
about the same robot describe such layers, with Hebbian weights among the feelings, but print no
constants. The structure comes from these papers; the exact form and all numbers are ours.

The potential of a neuron is its activation minus its refractoriness (the spike-response model of
Gerstner, Ritz and van Hemmen, Biological Cybernetics 69, 1993)::

    u(t) = a e^(−t/τ) − r e^(−t/(ρ τ))

where τ is the time constant of its level.

- A stimulus raises the activations of the emotion layer by the temperament's matrix.
- A neuron fires when u reaches θ: r rises by R, and the spike reaches the next layer. There the
  spike excites the same feeling, and inhibits the feelings that this one inhibits in the matrix.
- If a spike arrives while other neurons of the next layer are excited, the connections to these
  neurons become stronger (Hebb's rule). They weaken again within about a day.
- Every input moves an activation towards 0 or 1 by a share of the remaining distance. So the
  activations, which are the levels, stay in [0, 1].

A neuron whose level is held (``set_state``) keeps its activation and keeps firing. The mood is
relative to the temperament's resting mood, as in the other model. Spikes only run from layer to
layer, so the net falls silent by itself unless a level is held. Between spikes everything decays by
exact formulas, and the time of the next spike is the root of one equation. The cost of a step
therefore depends on its spikes, not on its length.
"""

from collections.abc import Mapping
from math import exp, inf, log
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from miburi.feelings.catalogue import FEELINGS
from miburi.feelings.model import FeelingModel
from miburi.feelings.temperament import Array, Temperament

_THRESHOLD = 0.1
_RESET = 0.2  # far below 1, so that the spike rate grows almost linearly with the activation
_RECOVERY = 0.25  # ρ: refractoriness fades four times as fast as the activation
_SYNAPSE = 0.07  # the share of a stimulus' effect that one spike passes on
_LEARNING = 0.01
_MOST_LEARNED = 0.15  # as a share of the weight to the same feeling
_FORGETTING = 86_400.0  # s
_NEWTON_STEPS = 8


class SpikingModel(FeelingModel):
    """Emotion, feeling and mood as three layers of spike-response neurons."""

    kind = "spiking"
    _limits: ClassVar = {
        "activation": 1,
        "refractory": 1 + _RESET,
        "trace": 1,
        "learned": 1,
        **FeelingModel._limits,
    }

    def __init__(self, temperament: Temperament | None = None) -> None:
        super().__init__(temperament)
        # The state at the last spike or input:
        n = len(FEELINGS)
        self._activation = np.zeros((3, n))
        self._refractory = np.zeros((3, n))
        self._trace = np.zeros((3, n))  # 1 at a spike, fading with the level
        self._learned = np.zeros((2, n, n))
        # The time in s since the last spike or input, and from it to each neuron's next spike:
        self._since = 0.0
        self._next = np.full((3, n), inf)

    def _current_levels(self) -> Array:
        level: Array = self._activation * np.exp(-self._decay_rates() * self._since)
        return level

    def _excite(self, feeling: int, strength: float) -> None:
        self._advance(self._since)
        self._receive(0, strength * self.temperament.matrix[feeling])
        self._pass(0.0)

    def _pass(self, dt: float) -> None:
        self._since += dt
        left = dt
        while (first := self._next.min()) <= self._since:
            layer, neuron = divmod(int(self._next.argmin()), len(FEELINGS))
            self._advance(first)
            # A spike can lower the mood, so lost mood recovers in two parts: up to the spike, and
            # after it.
            self._heal(left - self._since)
            left = self._since
            self._fire(layer, neuron)
        self._heal(left)

    def _set(self, row: int, values: Array) -> None:
        self._advance(self._since)
        self._activation[row] = values
        self._refractory[row] = 0
        self._trace[row] = 0
        self._plan(row)

    def _state(self) -> dict[str, NDArray[Any]]:
        return {**self._decay(self._since), **super()._state()}

    def _restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        self._activation, self._refractory = arrays["activation"], arrays["refractory"]
        self._trace, self._learned = arrays["trace"], arrays["learned"]
        self._since = 0.0
        super()._restore(arrays)
        for layer in range(3):
            self._plan(layer)

    @property
    def _weights(self) -> Array:
        """The two weights between the layers, each from one layer to the next."""
        shares = self.temperament.shares[:, 0]
        ratio = shares[1:] / np.maximum(shares[:-1], 1e-12)
        weights: Array = _SYNAPSE * np.minimum(ratio, 1)
        return weights

    def _decay_rates(self) -> Array:
        return np.where(self._held, 0.0, self.temperament.rates)

    def _decay(self, seconds: float) -> dict[str, Array]:
        rates = self.temperament.rates
        return {
            "activation": self._activation * np.exp(-self._decay_rates() * seconds),
            "refractory": self._refractory * np.exp(-rates / _RECOVERY * seconds),
            "trace": self._trace * np.exp(-rates * seconds),
            "learned": self._learned * np.exp(-seconds / _FORGETTING),
        }

    def _advance(self, seconds: float) -> None:
        """Advance the stored state by ``seconds``, in which no neuron fires."""
        state = self._decay(seconds)
        self._activation, self._refractory = state["activation"], state["refractory"]
        self._trace, self._learned = state["trace"], state["learned"]
        self._since -= seconds
        self._next = np.maximum(self._next - seconds, 0.0)

    def _receive(self, layer: int, effect: Array) -> None:
        effect = np.where(self._held[layer], 0.0, effect)
        remaining = 1 + np.minimum(effect, 0)
        self._activation[layer] *= remaining
        if layer == 2:
            self._inhibit_mood(remaining)
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
        # Hebb's rule: connections grow towards the neurons that are excited in the next layer.
        grows = np.where(innate < 0, 0.0, _LEARNING * self._trace[layer + 1])
        learned += grows * (_MOST_LEARNED - learned)
        own = np.arange(len(FEELINGS)) == neuron
        # The positive entries of the matrix already acted on the emotion layer. Between layers, a
        # spike excites other feelings only by learned connections.
        effect = np.where(own, 1.0, np.minimum(innate, 0)) + learned
        self._receive(layer + 1, self._weights[layer] * effect)

    def _plan(self, layer: int) -> None:
        """Compute when the neurons of a layer fire if no input arrives first."""
        fast = self.temperament.rates[layer] / _RECOVERY
        neurons = (
            self._activation[layer],
            self._refractory[layer],
            self._decay_rates()[layer],
            fast,
        )
        self._next[layer] = [
            _spike_time(*neuron) if neuron[0] >= _THRESHOLD else inf
            for neuron in zip(*(values.tolist() for values in neurons), strict=True)
        ]


def _spike_time(a: float, r: float, slow: float, fast: float) -> float:
    """Return when u(t) = a e^(−slow t) − r e^(−fast t) first reaches the threshold, in s."""
    if a - r >= _THRESHOLD:
        return 0.0
    if slow == 0:  # a held neuron
        return log(r / (a - _THRESHOLD)) / fast if a > _THRESHOLD else inf
    if r * fast <= a * slow:
        return inf
    # u rises to one peak and falls again.
    peak = log(r * fast / (a * slow)) / (fast - slow)
    if a * exp(-slow * peak) - r * exp(-fast * peak) <= _THRESHOLD:
        return inf
    # Up to the peak u is concave, so Newton's steps from 0 approach the root from below.
    t = 0.0
    for _ in range(_NEWTON_STEPS):
        up, down = a * exp(-slow * t), r * exp(-fast * t)
        t += (_THRESHOLD - up + down) / (fast * down - slow * up)
    return t
