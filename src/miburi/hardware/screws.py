"""Every screw of the robot: its kind, where its head sits, and which way its head faces.

It takes a robot and returns named groups of screws for the pictures and the bill of materials.
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
    lid_height,
    lid_screws,
)
from miburi.robot import Robot
from miburi.robot.description import Array
from miburi.robot.shape import BASE

__all__ = ["Screw", "drawn_screw", "screw_counts", "screws"]

#: For each kind of screw: radius, length, head radius and head height, mm.
_KINDS = {
    "M2x6": (1.0, 6.0, 1.75, 1.3),
    "M2x8": (1.0, 8.0, 1.75, 1.3),
    "M2.5x8": (1.25, 8.0, 2.25, 1.7),
    "M2.6x6": (1.3, 6.0, 2.6, 1.5),
    "M2.6x8": (1.3, 8.0, 2.6, 1.5),
    "M3x6": (1.5, 6.0, 2.75, 1.9),
}
#: Plastic left under a recessed screw head, mm.
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
        (3,) mm, under its head.
    way
        (3,) unit vector in the direction that the head faces; the driver comes from there.
    """

    kind: str
    link: str
    place: Array
    way: Array


def screws(robot: Robot) -> dict[str, list[Screw]]:
    """Return the screws by group: ``left_elbow horn``, ``chest``, and so on."""
    s, w = dimensions().servo, dimensions().wall
    table: dict[str, list[Screw]] = {}
    for mount in mounts(robot):

        def group(
            name: str, kind: str, points: list[tuple[float, float, float]], sign: int,
            link: str = mount.link, frame: Array = mount.frame, joint: str = mount.joint,
        ) -> None:  # fmt: skip
            table[f"{joint} {name}"] = [
                Screw(kind, link, frame @ np.array([*point, 1.0]), sign * frame[:, 1])
                for point in points
            ]

        sides = (-s.case_holes_x, s.case_holes_x)
        horn = s.horn_face + w.plate
        group("horn", "M2x6", [(x, horn, z) for x, z in servo.circle()], 1)
        if mount.idler:
            cheek = s.idler_face - w.plate
            far = s.case_holes_z[1]
            group("idler", "M2x6", [(x, cheek, z) for x, z in servo.circle()], -1)
            # The idlers in ROBOTIS's set come with their own screws; the printed idler is used in
            # the head.
            axle = "M2.6x6" if mount.joint == "head" else "M2.6x8"
            group("axle", axle, [(0.0, s.idler_face, 0.0)], -1)
            group("case", "M2x8", [(x, s.back - _UNDER, far) for x in sides], -1)
        else:
            front = s.front + _UNDER
            group("case", "M2x8", [(x, front, z) for z in s.case_holes_z for x in sides], 1)
    high = lid_height(robot)
    floor = -1000 * robot.shape.pedestal_height + w.shell
    board = floor + dimensions().mega.post + 1.6
    flange = neck_floor(robot) + NECK_FLANGE
    flat = {
        "card": ("M3x6", BASE, [(*place, board) for place in card_screws()], 2, 1),
        "column": ("M2.5x8", BASE, [(*place, high - 3.0) for place in column_screws(robot)], 2, -1),
        "lid": ("M2.5x8", BASE, [(*place, high) for place in lid_screws(robot)], 2, 1),
        "neck": ("M2.5x8", "torso", [(*place, flange) for place in NECK_SCREWS], 2, 1),
        "chest": (
            "M2x8",
            "torso",
            [(chest_face() + CHEST_SEAT, *p) for p in chest_screws(robot)],
            0,
            1,
        ),
    }
    for name, (kind, link, places, axis, sign) in flat.items():
        way = sign * np.eye(3)[axis]
        table[name] = [Screw(kind, link, np.array(place), way) for place in places]
    c = clamp(robot)
    table["jaw"] = [
        Screw("M3x6", "head", c.frame[:, :3] @ np.array([c.plate - 3.4, y, z]), -c.frame[:, 0])
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
    return join(
        [rod(under.tolist(), top.tolist(), head), rod(tip.tolist(), under.tolist(), radius)]
    )
