"""The setup of the experiment; by default it is that of the paper's Section 5."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from miburi.bma.settings import Settings
from miburi.errors import InputError
from miburi.feelings import (
    EmotionalModel,
    Expression,
    FeelingModel,
    Temperament,
    shipped_temperament,
)
from miburi.gestures import Repertoire


@dataclass(frozen=True)
class Setup:
    """The setup of an experiment; feeling, mood and period are the paper's.

    Emotion and mood are held. The mood recovers with the temperament's time constant. ``settings``
    are for the inverse kinematics; see :func:`miburi.ik.solve`.

    Raises InputError if a value is outside its range.
    """

    #: 0 or more; chooses which arm the hand blocks, when, and where, and among several gestures
    #: of the feeling.
    seed: int = 1
    seconds: float = 30.0  #: length in the robot's time, from one period to a day
    feeling: str = "happiness"
    mood: float = 0.9  #: 0 to 1
    period: float = 2.0  #: s from the start of one gesture to that of the next, 0.5 to 60
    temperament: Temperament = field(default_factory=shipped_temperament)
    settings: Settings | None = None
    repertoire: Repertoire | None = None  #: by default the gestures that ship with Miburi
    hand: bool = True  #: whether a hand gets in the way
    heal: bool = False  #: whether to watch the mood heal after the gestures
    model: type[FeelingModel] = EmotionalModel
    #: Other choices on the command line, such as the names of files; the report repeats them.
    chosen: Mapping[str, str | None] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise InputError(f"the seed must be 0 or more, got {self.seed}.")
        Expression(self.feeling, self.mood)  # refuses an unknown feeling or an invalid mood
        if not (np.isfinite(self.period) and 0.5 <= self.period <= 60):
            raise InputError(f"the period must be from 0.5 to 60 s, got {self.period:g}.")
        if not (np.isfinite(self.seconds) and self.period <= self.seconds <= 86_400):
            raise InputError(
                f"the length must be from {self.period:g} to 86400 s, got {self.seconds:g}."
            )

    def feelings(self) -> FeelingModel:
        """Return a model in which emotion and mood are held."""
        model = self.model(self.temperament)
        model.set_state(emotion={self.feeling: 1.0}, mood={self.feeling: self.mood}, hold=True)
        return model
