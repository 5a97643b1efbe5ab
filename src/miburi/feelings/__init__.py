"""Feelings (the paper's Section 4): turn stimuli into an emotion and its mood, to be shown."""

from miburi.feelings.cascade import EmotionalModel
from miburi.feelings.catalogue import FEELINGS
from miburi.feelings.model import (
    Expression,
    FeelingModel,
    Stimulus,
)
from miburi.feelings.spiking import SpikingModel
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
    "MODELS",
    "SOURCES",
    "TEMPERAMENTS",
    "EmotionalModel",
    "Expression",
    "FeelingModel",
    "SpikingModel",
    "Stimulus",
    "Temperament",
    "load_temperament",
    "shipped_temperament",
]

#: The emotional models by name; the first is the default.
MODELS: dict[str, type[FeelingModel]] = {
    model.kind: model for model in (EmotionalModel, SpikingModel)
}
