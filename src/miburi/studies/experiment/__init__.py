"""The paper's experiment (Section 5) on a physical body, with its measurements and files."""

from miburi.studies.experiment.procedure import STEP, STEPS_PER_FRAME, Experiment, conduct
from miburi.studies.experiment.records import FilmFrame
from miburi.studies.experiment.setup import Setup

__all__ = [
    "STEP",
    "STEPS_PER_FRAME",
    "Experiment",
    "FilmFrame",
    "Setup",
    "conduct",
]
