"""Feelings (Section 4): stimuli go in, an emotion and its mood come out for the body to show."""

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
