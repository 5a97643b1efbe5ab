"""Find the intent of a question that matches no pattern, with a linear model and a neural network.

``tools/train_intents.py`` and ``tools/train_network.py`` train them on lines by people outside the
project. There are models for English and Japanese.
"""

from collections.abc import Callable
from functools import cache
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from miburi.languages import Language, plain
from miburi.senses.linear import groups_of, load_model, numbered
from miburi.senses.network import agreed, load_network

__all__ = ["NOTHING", "asked_for"]

#: The name of the intent for remarks that request nothing.
NOTHING = "nothing"
_FILE = resources.files(__package__) / "intents.npz"


def asked_for(said: str, language: Language) -> tuple[str, float]:
    """Return the name of a sentence's likeliest intent, and how likely it is."""
    likelihoods = _model(language)
    if likelihoods is None:
        return NOTHING, 1.0
    likely = likelihoods(plain(said, language))
    best = int(likely.argmax())
    return _names(language)[best], float(likely[best])


@cache
def _model(language: Language) -> Callable[[str], NDArray[np.float64]] | None:
    linear, network = load_model(_FILE, language), load_network("intents", language)
    if linear is None or network is None:
        return None
    return lambda said: agreed(linear(numbered(groups_of(said, language))), network(said))


@cache
def _names(language: Language) -> list[str]:
    with _FILE.open("rb") as file:
        return [str(name) for name in np.load(file)[f"{language}_names"]]
