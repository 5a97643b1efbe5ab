"""The real shapes of a robot's links, for whatever draws it.

In goes a robot's description; out come solids in their links' frames, mm, by link and colour. The
phone is left out: it is drawn as the description has it.
"""

from functools import lru_cache
from typing import TYPE_CHECKING

from miburi.errors import MiburiError
from miburi.robot import Robot

if TYPE_CHECKING:
    from miburi.hardware.solids import Manifold

__all__ = ["shapes", "shapes_if_it_can_be_built"]

#: How far drawn shapes may be off, mm.
_FINE = 0.1
#: The colours of :data:`miburi.robot.shape.COLOURS`; parts not named are cream, servos graphite.
_COLOURED = {
    "foot": "clay", "lid": "clay", "column": "clay", "cradle": "coral", "jaw": "coral",
    "idler": "coral", "left_yoke": "coral", "right_yoke": "coral",
}  # fmt: skip


def shapes(robot: Robot) -> dict[tuple[str, str], "Manifold"]:
    """Return the solids drawn for each link, by the link's name and the colour.

    Raises
    ------
    InputError
        This robot cannot be built; the message says which length is too short, and by how much.
    """
    # The kernel is an optional extra; drawing code calls this even where it is not installed.
    from miburi.hardware.build import bodies, printed_parts
    from miburi.hardware.solids import join

    table: dict[tuple[str, str], list[Manifold]] = {}
    for thing in bodies(robot, printed_parts(robot, engraved=False)):
        if thing.name != "phone":
            colour = _COLOURED.get(thing.name, "cream" if thing.printed else "graphite")
            table.setdefault((thing.link, colour), []).append(thing.solid)
    return {key: join(solids).simplify(_FINE) for key, solids in table.items()}


@lru_cache(maxsize=2)
def shapes_if_it_can_be_built(robot: Robot) -> dict[tuple[str, str], "Manifold"]:
    """Return :func:`shapes`; without the extra, or if no parts fit the lengths, return {}."""
    try:
        return shapes(robot)
    except MiburiError:
        return {}
