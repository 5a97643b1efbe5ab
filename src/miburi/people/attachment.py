"""Attachment: how somebody has treated the partner, over weeks.

While a person is present, the attachment shifts the resting moods of the temperament. It depends on
that person's stimuli and contacts, and on time. An attachment is a second emotional model, with the
equations of the paper's three levels, in which time passes more slowly: an effect that lasts an
hour in a mood lasts three weeks in an attachment. The temperament has the constants.
"""

from collections.abc import Mapping
from typing import Any

from miburi.feelings import EmotionalModel, Temperament
from miburi.feelings.temperament import Array


def load_attachment(state: Mapping[str, Any] | None, temperament: Temperament) -> EmotionalModel:
    """Return an attachment from its saved ``state``; a new one if the state is None."""
    return EmotionalModel(temperament) if state is None else EmotionalModel.load(state, temperament)


def age(attachment: EmotionalModel, seconds: float) -> None:
    """Let ``seconds`` of real time pass."""
    attachment.step(seconds / attachment.temperament.attachment.slower)


def leaning_of(attachment: EmotionalModel) -> Array:
    """Return the shift of each resting mood, (n,) in [-1, 1], in the order of ``FEELINGS``."""
    temperament = attachment.temperament
    leaning: Array = temperament.attachment.leaning * (attachment.mood - temperament.rest)
    return leaning
