"""Feelings (Section 4): emotion, feeling and mood, a number for each on three time scales."""

from miburi.feelings.catalogue import FEELINGS
from miburi.feelings.model import (
    EmotionalModel,
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
