"""Attachment: how somebody has treated the partner, over weeks.

While a person is present, the attachment shifts the resting moods of the temperament. It depends on
that person's stimuli and contacts, and on time. An attachment is an emotional model of its own,
with the equations of the paper's three levels, in which time passes more slowly: what lasts an hour
in a mood lasts three weeks in an attachment. The temperament has the constants.
"""

from collections.abc import Iterable
from typing import Any

from miburi.errors import InputError
from miburi.feelings import EmotionalModel, Stimulus, Temperament
from miburi.feelings.temperament import Array
from miburi.ground.log import log_once

#: The state of a saved attachment; None for a new one.
State = dict[str, Any] | None


def lived(
    state: State,
    temperament: Temperament,
    seconds: float,
    stimuli: Iterable[Stimulus],
    contacts: int,
) -> State:
    """Return an attachment's state after ``seconds`` of real time followed by stimuli and contacts.

    A state that this version cannot use is returned unchanged, for a version that can use it.
    """
    try:
        attachment = _load(state, temperament)
    except InputError:  # leaning_of logs it
        return state
    attachment.step(seconds / temperament.attachment.slower)
    for stimulus in stimuli:
        attachment.stimulate(stimulus)
    for _ in range(contacts):
        attachment.contact()
    return attachment.save()


def leaning_of(state: State, temperament: Temperament) -> Array:
    """Return the shift of each resting mood, from -1 to 1; shape (n,), ordered as ``FEELINGS``."""
    try:
        attachment = _load(state, temperament)
    except InputError as error:
        log_once("an attachment cannot be used", error)
        attachment = EmotionalModel(temperament)
    leaning: Array = temperament.attachment.leaning * (attachment.mood - temperament.rest)
    return leaning


def _load(state: State, temperament: Temperament) -> EmotionalModel:
    return EmotionalModel(temperament) if state is None else EmotionalModel.load(state, temperament)
