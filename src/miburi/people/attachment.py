"""Attachment: how somebody has treated the partner, over weeks.

While a person is there, the resting moods differ from those of the temperament. The difference
depends on that person's stimuli and contacts, and on time. An attachment is an emotional model of
its own, with the equations of the paper's three levels; in it time passes more slowly: what lasts
an hour in a mood lasts three weeks in an attachment. The temperament has the constants.
"""

from collections.abc import Mapping
from typing import Any

from miburi.feelings import EmotionalModel, Stimulus, Temperament
from miburi.feelings.temperament import Array

__all__ = ["Attachment"]


class Attachment:
    """How one person has treated the partner.

    Parameters
    ----------
    temperament
        The partner's own.
    state
        What :meth:`save` returned for this person; None: they are new.
    """

    def __init__(self, temperament: Temperament, state: Mapping[str, Any] | None = None) -> None:
        new = EmotionalModel(temperament)
        self._model = new if state is None else EmotionalModel.load(state, temperament)

    def stimulate(self, stimulus: Stimulus) -> None:
        """Take in a stimulus from the person."""
        self._model.stimulate(stimulus)

    def contact(self) -> None:
        """Add a contact that the partner had while the person was there."""
        self._model.contact()

    def step(self, seconds: float) -> None:
        """Let real time pass."""
        self._model.step(seconds / self._model.temperament.attachment.slower)

    @property
    def leaning(self) -> Array:
        """What is added to each resting mood, (n,) in [-1, 1], in the order of ``FEELINGS``."""
        temperament = self._model.temperament
        leaning: Array = temperament.attachment.leaning * (self._model.mood - temperament.rest)
        return leaning

    def save(self) -> dict[str, Any]:
        """Return the state, ready for JSON."""
        return self._model.save()
