"""Models that find what patterns miss: the intent of a question, and lasting facts.

Intents come from a linear model and a neural network, facts from a linear model.
``tools/train_intents.py``, ``tools/train_network.py`` and ``tools/train_facts.py`` train them on
lines by people outside the project. There are models for English and Japanese.
"""

from collections.abc import Callable
from functools import cache
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from miburi.languages import Language, plain
from miburi.senses.linear import groups_of, load_model, numbered
from miburi.senses.network import agreed, load_network

#: The name of the intent for remarks that request nothing.
NOTHING = "nothing"
_INTENTS, _FACTS = (resources.files(__package__) / f"{name}.npz" for name in ("intents", "facts"))
#: Words above this likelihood count as a fact. The number is ours: among lines by writers who are
#: not in the training data, 79 to 90 % of the facts and 7 to 12 % of the other lines exceed it.
_LIKELY = 0.6


def asked_for(said: str, language: Language) -> tuple[str, float]:
    """Return the name of a sentence's likeliest intent, and its likelihood."""
    likelihoods = _model(language)
    if likelihoods is None:
        return NOTHING, 1.0
    likely = likelihoods(plain(said, language))
    best = int(likely.argmax())
    return _names(language)[best], float(likely[best])


@cache
def _model(language: Language) -> Callable[[str], NDArray[np.float64]] | None:
    linear, network = load_model(_INTENTS, language), load_network("intents", language)
    if linear is None or network is None:
        return None
    return lambda said: agreed(linear(numbered(groups_of(said, language))), network(said))


@cache
def _names(language: Language) -> list[str]:
    with _INTENTS.open("rb") as file:
        return [str(name) for name in np.load(file)[f"{language}_names"]]


def tells_a_fact(said: str, language: Language) -> bool:
    """Return whether words tell a lasting fact; False where a language has no model.

    >>> tells_a_fact("The wife's a nurse at the county hospital.", "en")
    True
    >>> tells_a_fact("I'm starving, what's for tea?", "en")
    False
    """
    model = _fact_model(language)
    if model is None:
        return False
    return bool(model(numbered(groups_of(plain(said, language), language)))[1] > _LIKELY)


@cache
def _fact_model(language: Language) -> Callable[[list[int]], NDArray[np.float64]] | None:
    return load_model(_FACTS, language)
