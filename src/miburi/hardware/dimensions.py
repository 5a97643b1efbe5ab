"""Read the dimensions that the parts are designed around: servo, walls, screws, Arduino.

``dimensions.toml`` becomes one immutable :class:`Dimensions`. Lengths are in mm, as in slicers and
drawings, here and in the whole package.
"""

from functools import cache
from importlib import resources
from typing import Annotated

from pydantic import Field

from miburi.ground.tables import Table, load_table

Pair = Annotated[list[float], Field(min_length=2, max_length=2)]


class ServoOutline(Table):
    """The servo's case, horn, holes and sockets in its own frame, in mm; ``mass`` in kg."""

    standing: str
    half_width: float
    back: float
    front: float
    short_end: float
    long_end: float
    horn_face: float
    horn_diameter: float
    horn_circle: float
    horn_depth: float
    case_holes_x: float
    case_holes_z: Pair
    grip_front: float
    grip_back: float
    idler_face: float
    socket_x: Pair
    socket_y: Pair
    socket_z: Pair
    plug_room: float
    mass: float
    centre: Annotated[list[float], Field(min_length=3, max_length=3)]


class Walls(Table):
    """Thicknesses, radii and gaps of the parts, in mm; ``stop`` in degrees."""

    standing: str
    shell: float
    least: float
    plate: float
    knuckle: float
    web: float
    cheek: float
    stop: float
    joint_gap: Pair
    bed: float


class ScrewHoles(Table):
    """Diameters of the holes for screws and their heads, in mm."""

    standing: str
    m2_clearance: float
    m2_head: float
    m2_pilot: float
    m25_clearance: float
    m25_head: float
    m25_pilot: float
    m3_clearance: float
    m3_pilot: float
    idler_screw: float


class MegaBoard(Table):
    """The Arduino Mega's outline, holes and USB socket, in mm."""

    standing: str
    length: float
    width: float
    holes: list[Pair]
    post: float
    height: float
    usb: Annotated[list[float], Field(min_length=3, max_length=3)]


class PrintSettings(Table):
    """The settings with which the parts are meant to be printed.

    ``layer`` is in mm, ``infill`` in per cent and ``density`` in g/cm³; ``perimeters`` is a count.
    """

    standing: str
    layer: float
    perimeters: int
    infill: int
    density: float


class Dimensions(Table):
    """All of ``dimensions.toml``."""

    servo: ServoOutline
    wall: Walls
    screws: ScrewHoles
    mega: MegaBoard
    printing: PrintSettings


@cache
def dimensions() -> Dimensions:
    """Return the dimensions that ship with Miburi."""
    with resources.as_file(resources.files(__package__) / "dimensions.toml") as path:
        return load_table(Dimensions, path)
