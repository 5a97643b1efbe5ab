"""The loads that the robot's own parts put on its motors: weight and inertia, in closed form.

The masses come from the description; each is centred in its part. The loads are used to aim goals
so high that a sagging joint ends where it should, to compute the torque that a move needs, and to
predict motions.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from miburi.robot.description import JOINTS, Array, Lengths, Masses, Robot, Shape
from miburi.robot.shape import Part, links, parts

#: m/s².
GRAVITY = 9.81


class Loads(NamedTuple):
    """The loads on the motors of a robot at rest.

    Attributes
    ----------
    gravity
        (..., 8) N·m, the torque that each motor must give to hold its joint.
    inertia
        (..., 8) kg·m², the inertia that each motor moves while all other joints are fixed; the
        motors' own rotors are not included.
    """

    gravity: Array
    inertia: Array


class _Solids(NamedTuple):
    """What does not depend on a robot's pose: its 8 links, and n parts with masses."""

    order: list[int]  # the links' joints
    parents: list[int]  # the links' parents; -1 for the base
    offsets: Array  # (8, 3), m in the parent's frame
    axes: Array  # (8, 3)
    links: list[int]  # (n,), the link that carries each part
    middles: Array  # (n, 3), m in the link's frame
    spreads: Array  # (n, 3, 3), m², mean of x xᵀ about the middle in the link's frame
    masses: Array  # (8, n), kg, of the parts that each joint turns


def link_poses(robot: Robot, angles: Array) -> tuple[Array, Array]:
    """Return each link's rotation, (..., 8, 3, 3), and its joint's position, (..., 8, 3) m.

    Both are in the base frame, in the order of :func:`~miburi.robot.shape.links`. ``angles`` has
    the shape (..., 8) and is in rad.
    """
    body = _solids(robot.lengths, robot.masses, robot.shape)
    turns = _turns(body.axes, angles[..., body.order])
    axles = np.zeros((*angles.shape[:-1], len(JOINTS), 3))
    for link, parent in enumerate(body.parents):
        # The torso, the first link, turns about the base.
        if parent >= 0:
            above = turns[..., parent, :, :]
            axles[..., link, :] = axles[..., parent, :] + above @ body.offsets[link]
            turns[..., link, :, :] = above @ turns[..., link, :, :]
        else:
            axles[..., link, :] = body.offsets[link]
    return turns, axles


def loads(robot: Robot, angles: Array) -> Loads:
    """Return the loads of the parts on the motors in a pose, (..., 8) rad."""
    body = _solids(robot.lengths, robot.masses, robot.shape)
    turns, axles = link_poses(robot, angles)
    # A joint's rotation does not change its own axis.
    axes = (turns @ body.axes[..., None])[..., 0]
    carried = (turns[..., body.links, :, :] @ body.middles[..., None])[..., 0]
    centres = axles[..., body.links, :] + carried
    x, y, z = np.moveaxis(axes[..., None, :], -1, 0)
    u, v, w = np.moveaxis(centres[..., None, :, :] - axles[..., None, :], -1, 0)
    up = x * v - y * u  # how far a turn of the joint lifts the part, m/rad
    far = (y * w - z * v) ** 2 + (z * u - x * w) ** 2 + up**2
    # A part's own extent adds the mean square distance of its mass from an axis through its middle.
    seen = np.einsum("...ki,...pij->...kpj", axes, turns[..., body.links, :, :])
    along = np.einsum("...kpi,pij,...kpj->...kp", seen, body.spreads, seen)
    far += np.trace(body.spreads, axis1=1, axis2=2) - along
    gravity, inertia = np.empty((2, *angles.shape))
    gravity[..., body.order] = GRAVITY * (up * body.masses).sum(axis=-1)
    inertia[..., body.order] = (far * body.masses).sum(axis=-1)
    return Loads(gravity, inertia)


@lru_cache(maxsize=64)
def _solids(lengths: Lengths, masses: Masses, shape: Shape) -> _Solids:
    # ``links`` and ``parts`` use only these three tables of a robot.
    robot = Robot.model_construct(lengths=lengths, masses=masses, shape=shape)
    table = links(robot)
    names = [link.name for link in table]
    heavy = [part for part in parts(robot) if part.mass and part.link in names]
    parents = [names.index(link.parent) if link.parent in names else -1 for link in table]
    carriers: list[set[int]] = []
    for number, parent in enumerate(parents):
        carriers.append({number} | (carriers[parent] if parent >= 0 else set()))
    where = [names.index(part.link) for part in heavy]
    return _Solids(
        order=[JOINTS.index(link.joint) for link in table],
        parents=parents,
        offsets=np.array([link.position for link in table], dtype=np.float64),
        axes=np.array([link.axis for link in table], dtype=np.float64),
        links=where,
        middles=np.array([part.middle for part in heavy]),
        spreads=np.array([_spread(part) for part in heavy]),
        masses=np.array(
            [
                [
                    part.mass * (joint in carriers[link])
                    for part, link in zip(heavy, where, strict=True)
                ]
                for joint in range(len(table))
            ]
        ),
    )


def _spread(part: Part) -> Array:
    """Return the mean of x xᵀ over a solid's mass, (3, 3) m²; x is measured from its middle."""
    size = np.array(part.size)
    if part.kind == "box":
        sine, cosine = np.sin(part.tilt), np.cos(part.tilt)
        turn = np.array([[cosine, 0.0, -sine], [0.0, 1.0, 0.0], [sine, 0.0, cosine]])
        box: Array = turn @ np.diag(size**2 / 3) @ turn.T
        return box
    radius = size[0]
    if part.end is None:
        sphere: Array = np.eye(3) * radius**2 / 5
        return sphere
    # A capsule consists of a cylinder and a ball in two halves.
    way = np.subtract(part.end, part.position)
    length = float(np.linalg.norm(way))
    ball = 4 * radius / (4 * radius + 3 * length)
    across = (1 - ball) * radius**2 / 4 + ball * radius**2 / 5
    halves = radius**2 / 5 + 3 * length * radius / 8 + length**2 / 4
    lengthwise = (1 - ball) * length**2 / 12 + ball * halves
    capsule: Array = np.eye(3) * across + np.outer(way, way) / length**2 * (lengthwise - across)
    return capsule


def _turns(axes: Array, angles: Array) -> Array:
    """Return rotation matrices, of shape (..., n, 3, 3).

    They turn by ``angles``, of shape (..., n), about unit ``axes``, of shape (n, 3).
    """
    (x, y, z), zero = axes.T, np.zeros(len(axes))
    cross = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
    sine, rest = np.sin(angles)[..., None, None], (1 - np.cos(angles))[..., None, None]
    turns: Array = np.eye(3) + sine * cross + rest * (cross @ cross)
    return turns
