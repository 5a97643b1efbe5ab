"""Feelings (Section 4): emotion, feeling and mood, eight numbers each on three time scales."""

from miburi.feelings.model import (
    EmotionalModel,
    Expression,
    FeelingModel,
    Stimulus,
)
from miburi.feelings.temperament import (
    FEELINGS,
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
