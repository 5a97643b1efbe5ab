"""What the robot's own parts load its motors with: their weight and inertia, in closed form.

The masses are the description's, each part's in its middle. Whoever drives the motors needs
them: to aim a goal above the sag, to know what torque a move takes, to expect a motion.
"""

from dataclasses import dataclass
from math import cos, sin

import numpy as np

from miburi.robot.description import JOINTS, Array, Robot
from miburi.robot.shape import Point, links, parts

#: m/s².
GRAVITY = 9.81


@dataclass(frozen=True)
class Loads:
    """What hangs on the motors of a robot at rest.

    Attributes
    ----------
    gravity
        (8,) N·m that each motor must give to hold its joint.
    inertia
        (8,) kg·m² that it moves, all other joints held; without rotors, and without what the
        parts' own extent adds.
    """

    gravity: Array
    inertia: Array


def loads(robot: Robot, angles: Array) -> Loads:
    """Return what the parts load the motors with at ``angles`` (8,) rad."""
    weighty = [part for part in parts(robot) if part.mass and part.link != "base"]
    masses = np.array([part.mass for part in weighty])
    middles = np.array([part.middle for part in weighty])
    carried = {link.name: [part.link == link.name for part in weighty] for link in links(robot)}
    places = np.empty_like(middles)
    frames = {"base": (np.eye(3), np.zeros(3))}
    axles: dict[str, tuple[Array, Array]] = {}
    for link in links(robot):
        turn, origin = frames[link.parent]
        place = origin + turn @ link.position
        axles[link.name] = place, turn @ link.axis
        turn = turn @ _turn(link.axis, float(angles[JOINTS.index(link.joint)]))
        frames[link.name] = turn, place
        own = carried[link.name]
        places[own] = place + middles[own] @ turn.T
    gravity, inertia = np.zeros(len(JOINTS)), np.zeros(len(JOINTS))
    for link in reversed(links(robot)):
        place, axis = axles[link.name]
        own = carried[link.name]
        arms = (places[own] - place) @ _cross(axis).T
        joint = JOINTS.index(link.joint)
        gravity[joint] = GRAVITY * masses[own] @ arms[:, 2]
        inertia[joint] = masses[own] @ (arms * arms).sum(axis=1)
        if link.parent in carried:
            carried[link.parent] = [a or b for a, b in zip(carried[link.parent], own, strict=True)]
    return Loads(gravity, inertia)


def _turn(axis: Point, angle: float) -> Array:
    """Return the turn by ``angle`` about ``axis``, of length 1, (3, 3)."""
    cross = _cross(axis)
    turn: Array = np.eye(3) + sin(angle) * cross + (1 - cos(angle)) * cross @ cross
    return turn


def _cross(axis: Point | Array) -> Array:
    """Return the matrix whose product with a vector is ``axis`` × that vector."""
    x, y, z = axis
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], dtype=np.float64)
