"""Find whether words tell a lasting fact about somebody's life, with a small linear model.

``tools/train_facts.py`` trains the model on English and Japanese lines by people outside the
project.
"""

from collections.abc import Callable
from functools import cache
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from miburi.languages import Language, plain
from miburi.senses.linear import groups_of, load_model, numbered

__all__ = ["tells_a_fact"]

#: The likelihood from which words count as a fact. The number is ours: of the facts by writers
#: whose lines were not in the training, 79 to 90 % score above it, and of their other lines 7 to 12
#: %.
_LIKELY = 0.6
_FILE = resources.files(__package__) / "facts.npz"


def tells_a_fact(said: str, language: Language) -> bool:
    """Return whether words tell a lasting fact; False where a language has no model.

    >>> tells_a_fact("The wife's a nurse at the county hospital.", "en")
    True
    >>> tells_a_fact("I'm starving, what's for tea?", "en")
    False
    """
    likelihoods = _model(language)
    if likelihoods is None:
        return False
    return bool(likelihoods(numbered(groups_of(plain(said, language), language)))[1] > _LIKELY)


@cache
def _model(language: Language) -> Callable[[list[int]], NDArray[np.float64]] | None:
    return load_model(_FILE, language)
