"""The gestures of a partner: one or more for each feeling, of which one is drawn by a seed.

A :class:`Repertoire` holds the gestures that ship with Miburi and those of a user's folder, if
there is one.

A user writes gestures for their own robot, so a pose that it cannot reach is refused. The shipped
gestures were written for the iphonoid, the paper's robot. Another robot goes as near to their poses
as its limits allow, so any robot can be used at once; :func:`misfits` lists the poses that are out
of its reach.
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


@dataclass(frozen=True)
class Repertoire:
    """The gestures of a partner.

    Attributes
    ----------
    functions
        At least one gesture for each feeling, in the order of ``FEELINGS``.

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
                    f"{count} gestures have the name {name!r}; give each its own name."
                )

    def of(self, feeling: str) -> tuple[MovementFunction, ...]:
        """Return the gestures that show a feeling."""
        return tuple(function for function in self.functions if function.feeling == feeling)

    def choose(self, feeling: str, rng: np.random.Generator) -> MovementFunction:
        """Draw one gesture of a feeling; with a single gesture the generator is not used."""
        choice = self.of(feeling)
        return choice[0] if len(choice) == 1 else choice[int(rng.integers(len(choice)))]


@lru_cache(maxsize=1)
def shipped_functions() -> tuple[MovementFunction, ...]:
    """Return the gestures that ship with Miburi; none of them shows a feeling of your own."""
    return tuple(map(load, shipped_feelings()))


@lru_cache(maxsize=1)
def shipped_repertoire() -> Repertoire:
    """Return the repertoire of the gestures that ship with Miburi.

    Raises InputError if this process has a feeling of your own; see :func:`read_repertoire`.
    """
    return Repertoire(shipped_functions())


def read_repertoire(folder: Path | str, robot: Robot) -> Repertoire:
    """Read a user's gestures for ``robot``: all ``*.toml`` files of a folder.

    The user's gestures replace all shipped gestures of the same feelings; other feelings keep their
    shipped gestures.

    Raises
    ------
    DescriptionError
        The folder has no gesture file, a file is wrong, or the robot cannot reach a key pose.
    InputError
        A feeling has no gesture, or two gestures have the same name.
    """
    own = [load_for(robot, path) for path in sorted(Path(folder).glob("*.toml"))]
    if not own:
        raise DescriptionError(f"{folder}: there is no gesture file (*.toml) in this folder.")
    replaced = {function.feeling for function in own}
    own += [function for function in shipped_functions() if function.feeling not in replaced]
    return Repertoire(tuple(sorted(own, key=lambda f: FEELINGS.index(f.feeling))))
