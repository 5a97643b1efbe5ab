"""Every screw of the robot: its kind, where its head sits, and which way its head faces.

This module takes a robot and returns named groups of screws for the pictures and the bill of
materials.
"""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from miburi.hardware import servo
from miburi.hardware.dimensions import dimensions
from miburi.hardware.head import NECK_FLANGE, clamp, jaw_rows
from miburi.hardware.places import mounts, neck_floor
from miburi.hardware.solids import Manifold, join, rod
from miburi.hardware.trunk import (
    CHEST_SEAT,
    NECK_SCREWS,
    card_screws,
    chest_face,
    chest_screws,
    column_screws,
    foot_floor,
    lid_height,
    lid_screws,
)
from miburi.robot import Robot
from miburi.robot.description import Array
from miburi.robot.shape import BASE

#: For each kind of screw: radius, length, head radius and head height, mm.
_KINDS = {
    "M2x6": (1.0, 6.0, 1.75, 1.3),
    "M2x8": (1.0, 8.0, 1.75, 1.3),
    "M2.5x8": (1.25, 8.0, 2.25, 1.7),
    "M2.6x6": (1.3, 6.0, 2.6, 1.5),
    "M2.6x8": (1.3, 8.0, 2.6, 1.5),
    "M3x6": (1.5, 6.0, 2.75, 1.9),
}
#: How much plastic is left under a recessed screw head, in mm.
_UNDER = 1.3


@dataclass(frozen=True)
class Screw:
    """One screw and where it sits on the robot.

    Attributes
    ----------
    kind
        Such as ``M2x6``.
    link
        The link in whose frame ``place`` and ``way`` are.
    place
        The point under the screw's head, as three coordinates in mm.
    way
        The direction in which the head faces, as a unit vector; the driver comes from that side.
    """

    kind: str
    link: str
    place: Array
    way: Array


def screws(robot: Robot) -> dict[str, list[Screw]]:
    """Return the screws by group: ``left_elbow horn``, ``chest``, and so on."""
    s, w = dimensions().servo, dimensions().wall
    table: dict[str, list[Screw]] = {}
    sides = (-s.case_holes_x, s.case_holes_x)
    for mount in mounts(robot):
        # Each group's kind, places in the servo's frame, and whether heads face along its axle.
        groups = {"horn": ("M2x6", [(x, s.horn_face + w.plate, z) for x, z in servo.circle()], 1)}
        if mount.idler:
            # The idlers in ROBOTIS's set come with their own screws; the head uses the printed
            # idler.
            axle = "M2.6x6" if mount.joint == "head" else "M2.6x8"
            rear, far = s.idler_face - w.plate, s.case_holes_z[1]
            groups |= {
                "idler": ("M2x6", [(x, rear, z) for x, z in servo.circle()], -1),
                "axle": (axle, [(0.0, s.idler_face, 0.0)], -1),
                "case": ("M2x8", [(x, s.back - _UNDER, far) for x in sides], -1),
            }
        else:
            front = [(x, s.front + _UNDER, z) for z in s.case_holes_z for x in sides]
            groups["case"] = ("M2x8", front, 1)
        for name, (kind, points, sign) in groups.items():
            table[f"{mount.joint} {name}"] = [
                Screw(kind, mount.link, mount.frame @ [*point, 1.0], sign * mount.frame[:, 1])
                for point in points
            ]
    high = lid_height(robot)
    board = foot_floor(robot) + dimensions().mega.post + 1.6
    flange = neck_floor(robot) + NECK_FLANGE
    front_of_chest = chest_face() + CHEST_SEAT
    up, ahead = np.eye(3)[2], np.eye(3)[0]
    flat = {
        "card": ("M3x6", BASE, [(*place, board) for place in card_screws()], up),
        "column": ("M2.5x8", BASE, [(*place, high - 3.0) for place in column_screws(robot)], -up),
        "lid": ("M2.5x8", BASE, [(*place, high) for place in lid_screws(robot)], up),
        "neck": ("M2.5x8", "torso", [(*place, flange) for place in NECK_SCREWS], up),
        "chest": ("M2x8", "torso", [(front_of_chest, *p) for p in chest_screws(robot)], ahead),
    }
    for name, (kind, link, places, way) in flat.items():
        table[name] = [Screw(kind, link, np.array(place), way) for place in places]
    c = clamp(robot)
    table["jaw"] = [
        Screw("M3x6", "head", c.frame[:, :3] @ [c.plate - 3.4, y, z], -c.frame[:, 0])
        for y, z in jaw_rows(robot)
    ]
    return table


def screw_counts(robot: Robot) -> Counter[str]:
    """Return how many screws of each kind the robot needs."""
    return Counter(screw.kind for group in screws(robot).values() for screw in group)


def drawn_screw(screw: Screw, away: float) -> Manifold:
    """Return a screw's solid, pulled out of its hole by ``away`` mm, on its link."""
    radius, length, head, high = _KINDS[screw.kind]
    under = screw.place + away * screw.way
    top, tip = under + high * screw.way, under - length * screw.way
    return join([rod(under, top, head), rod(tip, under, radius)])
