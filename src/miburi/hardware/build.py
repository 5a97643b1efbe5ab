"""Make every printed part of a robot, and put the whole body together in a pose.

Parts are in their links' frames. Lengths are in mm.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import pi

import numpy as np

from miburi.errors import InputError
from miburi.hardware import arms, engraving, head, servo, trunk
from miburi.hardware.dimensions import dimensions
from miburi.hardware.exports import triangles
from miburi.hardware.places import misfits, mount_of, mounts
from miburi.hardware.solids import Manifold, cut, mirror_y, moved
from miburi.robot import Robot
from miburi.robot.description import Array
from miburi.robot.loads import link_poses
from miburi.robot.shape import BASE, links

#: The gap on each side of a pocket, in mm, for a sliding fit; the number is from printing guides.
FIT = 0.25
#: Edges shorter than this, in mm, are dropped, because slicers store corners in single precision.
_SMALLEST = 0.005
#: The thickness of a part's solid skin, in mm, on level and on upright faces; and the share of its
#: inside that is filled. Both were fitted to sliced parts; see :func:`printed_mass`.
_SKIN, _INFILL = (0.55, 1.4), 0.21


#: The length in the robot's description that sets each part's size.
_LENGTH = {
    "foot": "shape.pedestal_radius",
    "lid": "shape.pedestal_radius",
    "column": "shape.pedestal_height",
    "torso": "lengths.L01",
    "chest": "lengths.L01",
    "neck": "lengths.LH1",
    "cradle": "shape.phone_width",
    **{f"{side}_yoke": "lengths.L12" for side in ("left", "right")},
    **{f"{side}_upper_arm": "lengths.L23" for side in ("left", "right")},
    **{f"{side}_forearm": "lengths.L34" for side in ("left", "right")},
}


@dataclass(frozen=True)
class Solid:
    """One rigid component of the body: a printed part, a servo or the phone.

    Attributes
    ----------
    name, link
        The component's name, and the link that carries the component.
    solid
        The component's shape, in mm in the frame of the link.
    """

    name: str
    link: str
    solid: Manifold


@dataclass(frozen=True)
class PrintedPart(Solid):
    """A part to print; its name is also the name of its file.

    Attributes
    ----------
    lying
        The rotation that lays the part on the printer's bed, with shape (3, 3).
    """

    lying: Array

    @property
    def on_the_bed(self) -> Manifold:
        """The part as it is printed: turned, and standing on z = 0."""
        turned = moved(self.solid, np.hstack([self.lying, np.zeros((3, 1))]))
        x, y, z, right, back, _ = turned.bounding_box()
        return turned.translate((-(x + right) / 2, -(y + back) / 2, -z))


def _turn(axis: str, degrees: float) -> Array:
    """Return the rotation matrix, (3, 3), for a turn about an axis."""
    angle, i = degrees * pi / 180, "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    turn = np.eye(3)
    turn[j, j] = turn[k, k] = np.cos(angle)
    turn[j, k], turn[k, j] = -np.sin(angle), np.sin(angle)
    return turn


def check_fit(fit: float) -> None:
    """Raise an InputError if a gap is out of range."""
    if not 0 <= fit <= 0.6:
        raise InputError(f"fit must be from 0 to 0.6 mm, got {fit}.")


def printed_parts(robot: Robot, fit: float = FIT, *, engraved: bool = True) -> list[PrintedPart]:
    """Return the parts to print.

    Parameters
    ----------
    robot
        Its description has the lengths, the joints' ranges and the size of the phone.
    fit
        The gap on each side of what is pushed into a pocket, from 0 to 0.6 mm. Print the fit gauge
        to find it for your printer.
    engraved
        Whether names and numbers are cut in.

    Raises
    ------
    InputError
        ``fit`` is out of range, or the servo or a length does not allow the parts; the message says
        which.
    """
    check_fit(fit)
    if lines := misfits(robot):
        raise InputError("this robot cannot be built:\n  " + "\n  ".join(lines))
    # Of the poses tried, these need the least support, and the layers run along the forks.
    flat, upside_down, on_its_back = np.eye(3), _turn("x", 180.0), _turn("y", -90.0)
    on_its_side = _turn("x", 90.0)
    on_the_plate = _turn("y", 90.0 - float(np.degrees(robot.shape.phone_level)))
    idler = moved(servo.idler(fit), mount_of(robot, "head").frame)
    table = [
        PrintedPart("foot", BASE, trunk.foot(robot), flat),
        PrintedPart("lid", BASE, trunk.lid(robot), upside_down),
        PrintedPart("column", BASE, trunk.column(robot, fit), upside_down),
        PrintedPart("torso", "torso", trunk.torso(robot, fit), on_its_back),
        PrintedPart("chest", "torso", trunk.chest(robot, fit), flat),
        PrintedPart("neck", "torso", head.neck(robot, fit), on_its_side),
        PrintedPart("cradle", "head", head.cradle(robot), on_the_plate),
        PrintedPart("jaw", "head", head.jaw(robot), on_the_plate),
        PrintedPart("idler", "torso", idler, on_its_side),
    ]
    for side in ("left", "right"):
        for name, link, made, lying in (
            ("yoke", "shoulder", arms.yoke(robot, side, fit), upside_down),
            ("upper_arm", "upper_arm", arms.upper_arm(robot, side, fit), flat),
            ("forearm", "forearm", arms.forearm(robot), flat),
        ):
            solid = made if side == "left" else mirror_y(made)
            table.append(PrintedPart(f"{side}_{name}", f"{side}_{link}", solid, lying))
    slots = engraving.notch_slots(robot)
    letters = engraving.texts(robot, fit) if engraved else {}
    finished, bed = [], dimensions().wall.bed
    for bare in table:
        tools = [*letters.get(bare.name, []), *([slots[bare.name]] if bare.name in slots else [])]
        part = replace(bare, solid=cut(bare.solid, tools).as_original().simplify(_SMALLEST))
        if len(part.solid.decompose()) != 1:
            raise InputError(
                f"this robot cannot be built: its {part.name} would be in several pieces. Look at "
                f"{_LENGTH.get(part.name, 'its lengths')}, the phone's size, phone_below and "
                "phone_level."
            )
        finished.append(part)
    for part in finished:
        low, high = np.reshape(part.on_the_bed.bounding_box(), (2, 3))
        if (largest := float(np.max(high - low))) > bed:
            raise InputError(
                f"this robot cannot be built: {part.name} is {largest:.1f} mm long, and common "
                f"printers have a bed of {bed:.0f} mm: take "
                f"{largest - bed:.1f} mm off {_LENGTH.get(part.name, 'its lengths')}."
            )
    return finished


def printed_mass(part: PrintedPart) -> float:
    """Return the mass in kg of a printed part, which has a solid skin and infill within.

    Skin and infill were fitted to the grams that PrusaSlicer 2.5 gives for the parts of the
    buildable robot without supports: each within 9 %, the sum within 2 %.
    """
    corners, faces = triangles(part.on_the_bed)
    a, b, c = np.moveaxis(corners[faces], 1, 0)
    areas = np.cross(b - a, c - a) / 2
    flat = np.abs(areas[:, 2]).sum()
    whole = np.linalg.norm(areas, axis=1).sum()
    volume = part.solid.volume()
    skin = min(volume, _SKIN[0] * flat + _SKIN[1] * (whole - flat))
    return float((skin + _INFILL * (volume - skin)) * dimensions().printing.density * 1e-6)


def link_frames(robot: Robot, angles: Array) -> dict[str, Array]:
    """Return each link's frame, (3, 4) in mm in the base frame, for eight angles in rad."""
    turns, joints = link_poses(robot, angles)
    frames = np.concatenate([turns, 1000 * joints[..., None]], axis=-1)
    found = {link.name: frame for link, frame in zip(links(robot), frames, strict=True)}
    return found | {BASE: np.hstack([np.eye(3), np.zeros((3, 1))])}


def bodies(robot: Robot, parts: Iterable[PrintedPart]) -> list[Solid]:
    """Return every rigid thing of the robot in its own link's frame: parts, servos, the phone."""
    things: list[Solid] = list(parts)
    for mount in mounts(robot):
        solid = moved(servo.outline(idler_too=mount.joint != "head" and mount.idler), mount.frame)
        things.append(Solid(f"{mount.joint} servo", mount.link, solid))
    return [*things, Solid("phone", "head", head.phone(robot))]
