"""Weight, balance and servo torques of the built robot.

From the robot's solids with their masses and a motion, this module computes masses in kg, distances
in mm and torques in N·m. A motion has a row of eight angles, in rad, for each pose.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from miburi.hardware.build import PrintedPart, link_frames, printed_mass
from miburi.hardware.dimensions import dimensions
from miburi.hardware.exports import triangles
from miburi.hardware.head import phone
from miburi.hardware.places import mounts
from miburi.hardware.solids import Manifold
from miburi.robot import Robot
from miburi.robot.description import Array
from miburi.robot.loads import GRAVITY, loads
from miburi.robot.shape import BASE

#: The mass of the Arduino Mega with its wires, in kg.
_CARD = 0.06
#: The density of loose steel shot, nuts or washers, in kg/mm³ (our choice).
_BALLAST = 4.3e-6
#: The mass of screws and cables for each servo, in kg (our choice).
_SMALL = 0.004


@dataclass(frozen=True)
class Weight:
    """A thing's mass.

    Attributes
    ----------
    name, link
        The thing's name, and the robot's link that carries the thing.
    mass
        The mass in kg.
    centre
        The centre of mass, in mm in the frame of that link.
    """

    name: str
    link: str
    mass: float
    centre: Array


def _centre(solid: Manifold) -> Array:
    corners, faces = triangles(solid)
    a, b, c = np.moveaxis(corners[faces], 1, 0)
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c))
    middle: Array = ((a + b + c) * volumes[:, None]).sum(axis=0) / volumes.sum() / 4
    return middle


def weights(robot: Robot, parts: Sequence[PrintedPart]) -> list[Weight]:
    """Return everything with a mass: parts, servos with their screws and cables, phone, foot."""
    table = [
        Weight(part.name, part.link, printed_mass(part), _centre(part.solid)) for part in parts
    ]
    cradle = sum(weight.mass for weight in table if weight.link == "head")
    s = dimensions().servo
    for mount in mounts(robot):
        centre = mount.frame @ np.array([*s.centre, 1.0])
        table.append(Weight(f"{mount.joint} servo", mount.link, s.mass + _SMALL, centre))
    low = -1000 * robot.shape.pedestal_height
    return [
        *table,
        # The phone's mass in the description includes the cradle.
        Weight("phone", "head", max(robot.masses.phone - cradle, 0.0), _centre(phone(robot))),
        Weight("ballast", BASE, ballast(robot), np.array([0.0, 0.0, low + 10.0])),
        Weight("card", BASE, _CARD, np.array([0.0, 0.0, low + 8.0])),
    ]


def ballast(robot: Robot) -> float:
    """Return how much loose steel the foot's two chambers hold, kg."""
    w, m = dimensions().wall, dimensions().mega
    radius = 1000 * robot.shape.pedestal_radius - w.shell
    chord = m.width / 2 + 1.5 + w.shell
    area = radius**2 * np.arccos(chord / radius) - chord * np.sqrt(radius**2 - chord**2)
    # The chambers are filled up to the ribs; 10 % of their volume is lost to posts and corners.
    return float(0.9 * 2 * area * (m.post + 1.6 + m.height - 4.0) * _BALLAST)


def description_masses(table: Sequence[Weight]) -> dict[str, float]:
    """Return the table ``[masses]`` for the robot's file: sums of the weights, in kg."""
    links = {
        "torso": "torso",
        "upper_arm": "left_upper_arm",
        "forearm": "left_forearm",
        "shoulder": "left_shoulder",
        "phone": "head",
    }
    return {
        key: sum(weight.mass for weight in table if weight.link == link)
        for key, link in links.items()
    }


def zero_moment_radius(
    robot: Robot, table: Sequence[Weight], motion: Array, period: float
) -> float:
    """Return the greatest distance of the zero-moment point from the foot's middle, mm.

    ``motion`` has one pose every ``period`` s. The robot does not tip while the zero-moment point
    stays within the foot's radius. A motion of fewer than three poses gives 0.
    """
    frames = [link_frames(robot, pose) for pose in motion]
    places = np.array([[frame[one.link] @ [*one.centre, 1.0] for one in table] for frame in frames])
    masses = np.array([weight.mass for weight in table])
    places[..., 2] += 1000 * robot.shape.pedestal_height
    moved = places[2:] - 2 * places[1:-1] + places[:-2]
    pull = moved / period**2
    here = places[1:-1]
    upright = pull[..., 2] + 1000 * GRAVITY
    down = (masses * upright).sum(axis=1)
    point = [
        (masses * (upright * here[..., axis] - pull[..., axis] * here[..., 2])).sum(axis=1) / down
        for axis in (0, 1)
    ]
    # If nothing presses the foot down, the robot lifts off the table.
    return float(np.where(down > 0, np.hypot(*point), np.inf).max(initial=0.0))


def torques(robot: Robot, poses: Array) -> tuple[Array, Array]:
    """Return each joint's greatest torque, at rest and at the robot's greatest acceleration.

    ``poses`` has a row of eight angles, in rad, for each pose. Both results have eight torques, in
    N·m.
    """
    load = loads(robot, poses)
    standing = np.abs(load.gravity).max(axis=0)
    moving = (np.abs(load.gravity) + load.inertia * robot.servo.acceleration).max(axis=0)
    return standing, moving
