"""Feelings (the paper's Section 4): turn stimuli into an emotion and its mood, to be shown."""

from miburi.feelings.cascade import EmotionalModel
from miburi.feelings.catalogue import FEELINGS
from miburi.feelings.model import (
    Expression,
    FeelingModel,
    Stimulus,
)
from miburi.feelings.temperament import (
    LEVELS,
    SOURCES,
    TEMPERAMENTS,
    Temperament,
    load_temperament,
    shipped_temperament,
)

__all__ = [
    "FEELINGS",
    "LEVELS",
    "SOURCES",
    "TEMPERAMENTS",
    "EmotionalModel",
    "Expression",
    "FeelingModel",
    "Stimulus",
    "Temperament",
    "load_temperament",
    "shipped_temperament",
]
