"""The real shapes of a robot's links, for whatever draws it.

This module takes a robot's description and returns solids by link and colour, in mm in the frames
of their links. The phone is not among them: it is drawn from the description.
"""

from functools import lru_cache
from typing import TYPE_CHECKING

from miburi.errors import MiburiError
from miburi.robot import Robot

if TYPE_CHECKING:
    from miburi.hardware.solids import Manifold


#: How far drawn shapes may be off the true ones, in mm.
_FINE = 0.1
#: Colours, by their names in :data:`miburi.robot.shape.COLOURS`. Parts that are not listed are
#: cream; servos are graphite.
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
    # The geometry kernel is an optional extra, so it is imported here.
    from miburi.hardware.build import PrintedPart, bodies, printed_parts
    from miburi.hardware.solids import join

    table: dict[tuple[str, str], list[Manifold]] = {}
    for thing in bodies(robot, printed_parts(robot, engraved=False)):
        if thing.name != "phone":
            colour = _COLOURED.get(
                thing.name, "cream" if isinstance(thing, PrintedPart) else "graphite"
            )
            table.setdefault((thing.link, colour), []).append(thing.solid)
    return {key: join(solids).simplify(_FINE) for key, solids in table.items()}


@lru_cache(maxsize=2)
def shapes_if_it_can_be_built(robot: Robot) -> dict[tuple[str, str], "Manifold"]:
    """Return :func:`shapes`, or {} if the extra is missing or the robot cannot be built."""
    try:
        return shapes(robot)
    except MiburiError:
        return {}
