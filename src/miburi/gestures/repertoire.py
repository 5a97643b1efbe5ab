"""What gestures a partner has: for each feeling one or more, of which a seed chooses.

In go the gestures that ship with Miburi and, if a user has some, a folder of gesture files; out
comes a :class:`Repertoire`, which the partner, the trials and the gallery perform from.

A user's gesture is written for the user's robot: what the robot cannot do is a mistake, and is
refused. A shipped gesture was written for the iphonoid: another robot bends it to what its joint
limits allow, so that every robot can be run at once; :func:`misfits` names those poses.
"""

from collections import Counter
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from miburi.errors import DescriptionError, InputError
from miburi.feelings import FEELINGS
from miburi.gestures.movement import MovementFunction, load, load_for, shipped_feelings
from miburi.robot import Robot

__all__ = ["Repertoire", "read_repertoire", "shipped"]


@dataclass(frozen=True)
class Repertoire:
    """The gestures of a partner, in the order of ``FEELINGS``.

    Raises
    ------
    InputError
        A feeling has no gesture, or two gestures have the same name.
    """

    functions: tuple[MovementFunction, ...]

    def __post_init__(self) -> None:
        missing = [feeling for feeling in FEELINGS if not self.of(feeling)]
        if missing:
            raise InputError(
                f"There is no gesture for {', '.join(missing)}; write a gesture file with "
                f'feeling = "{missing[0]}".'
            )
        for name, count in Counter(function.name for function in self.functions).items():
            if count > 1:
                raise InputError(
                    f"{count} gestures have the name {name!r}; give each a name of its own."
                )

    def of(self, feeling: str) -> tuple[MovementFunction, ...]:
        """Return the gestures that show a feeling."""
        return tuple(function for function in self.functions if function.feeling == feeling)

    def choose(self, feeling: str, rng: np.random.Generator) -> MovementFunction:
        """Draw one of a feeling's gestures; nothing is drawn where there is one alone."""
        choice = self.of(feeling)
        return choice[0] if len(choice) == 1 else choice[int(rng.integers(len(choice)))]


@lru_cache(maxsize=1)
def shipped() -> Repertoire:
    """Return the gestures that ship with Miburi."""
    return Repertoire(tuple(map(load, shipped_feelings())))


def read_repertoire(folder: Path | str, robot: Robot) -> Repertoire:
    """Read a user's gestures for ``robot``: all files ``*.toml`` of a folder.

    They replace the shipped gestures of the feelings that they show; the other feelings keep
    theirs.

    Raises
    ------
    DescriptionError
        There is no gesture file in the folder, a file is not one, or the robot cannot do it.
    InputError
        A feeling has no gesture, or two gestures have the same name.
    """
    own = [load_for(robot, path) for path in sorted(Path(folder).glob("*.toml"))]
    if not own:
        raise DescriptionError(f"{folder}: there is no gesture file (*.toml) in this folder.")
    shown = {function.feeling for function in own}
    own += [load(feeling) for feeling in shipped_feelings() if feeling not in shown]
    return Repertoire(tuple(sorted(own, key=lambda f: FEELINGS.index(f.feeling))))
