"""Section 5 of the paper on a physical body: what it does, what it measures, its files."""

from miburi.studies.experiment.procedure import STEP, STEPS_PER_FRAME, Experiment, Frame, conduct

__all__ = [
    "STEP",
    "STEPS_PER_FRAME",
    "Experiment",
    "Frame",
    "conduct",
]
