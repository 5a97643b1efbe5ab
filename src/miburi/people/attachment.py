"""Attachment: how somebody has treated the partner, over weeks.

While a person is there, the resting moods differ from those of the temperament. The difference
depends on that person's stimuli and contacts, and on time. An attachment is an emotional model of
its own, with the equations of the paper's three levels; in it time passes more slowly: what lasts
an hour in a mood lasts three weeks in an attachment. The temperament has the constants.
"""

from collections.abc import Mapping
from typing import Any

from miburi.feelings import EmotionalModel, Temperament
from miburi.feelings.temperament import Array


def load_attachment(state: Mapping[str, Any] | None, temperament: Temperament) -> EmotionalModel:
    """Return an attachment from its saved ``state``; None: a new one, for somebody new."""
    return EmotionalModel(temperament) if state is None else EmotionalModel.load(state, temperament)


def age(attachment: EmotionalModel, seconds: float) -> None:
    """Let ``seconds`` of real time pass."""
    attachment.step(seconds / attachment.temperament.attachment.slower)


def leaning_of(attachment: EmotionalModel) -> Array:
    """Return the shift of each resting mood, (n,) in [-1, 1], in the order of ``FEELINGS``."""
    temperament = attachment.temperament
    leaning: Array = temperament.attachment.leaning * (attachment.mood - temperament.rest)
    return leaning
