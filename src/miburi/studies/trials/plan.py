"""The plan of a run of trials."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import NamedTuple

import numpy as np

from miburi.errors import InputError
from miburi.gestures import Repertoire, shipped_functions, shipped_repertoire
from miburi.robot import Robot
from miburi.safety.contact import Rule
from miburi.studies.trials.trial import TrialKind
from miburi.version import __version__

#: Trials in a chunk, about a second's work for a process.
CHUNK = 25

Chunk = tuple[TrialKind, int, int]  # kind, first index, index after the last


class Subject(NamedTuple):
    """A robot's description, the rule that watches it, and the true robot.

    ``true`` is None if the robot is as described; ``voltage`` is None if each trial draws its own.
    """

    robot: Robot
    rule: Rule
    true: Robot | None = None
    voltage: float | None = None


@dataclass(frozen=True)
class Plan:
    """A run of ``free`` and ``blocked`` trials, of robots that differ in their servos.

    Trial i uses servo i modulo the number of servos. A file of trials has the command line's
    options, ``chosen``, in its metadata.

    Raises InputError if there is no servo or no trial, or a number is negative.
    """

    servos: tuple[Subject, ...]
    seed: int
    free: int
    blocked: int
    repertoire: Repertoire = field(default_factory=shipped_repertoire)
    chosen: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.servos:
            raise InputError("a run of trials needs at least one servo.")
        for name in ("seed", "free", "blocked"):
            if getattr(self, name) < 0:
                raise InputError(f"{name} must be 0 or more, got {getattr(self, name)}.")
        if self.free + self.blocked == 0:
            raise InputError("a run needs at least one trial, free or blocked.")

    @property
    def key(self) -> str:
        """A checksum of the run; runs with the same key have the same results."""
        words = hashlib.sha256(f"{__version__} {self.seed} {self.free} {self.blocked}".encode())
        for robot, rule, true, voltage in self.servos:
            servo = [robot.model_dump(), type(rule).__name__, asdict(rule)]
            servo += [true.model_dump()] if true else []
            servo += [{"voltage": voltage}] if voltage else []
            words.update(json.dumps(servo, sort_keys=True, default=np.ndarray.tolist).encode())
        if self.repertoire.functions != shipped_functions():
            for function in self.repertoire.functions:
                words.update(function.model_dump_json().encode())
        return words.hexdigest()[:16]

    @property
    def chunks(self) -> list[Chunk]:
        """The chunks of the run, in order."""
        return [
            (kind, first, min(first + CHUNK, count))
            for kind, count in ((TrialKind.FREE, self.free), (TrialKind.BLOCKED, self.blocked))
            for first in range(0, count, CHUNK)
        ]
