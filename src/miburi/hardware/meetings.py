"""Find collisions between parts of a built robot: over each joint's range, and in every gesture.

This module takes a robot, its solids and poses, and yields the parts, links or joints that collide.
Shapes are the real ones: parts, servos, phone. An overlap of up to 0.5 mm³ does not count, because
faces that merely touch overlap by less.
"""

from collections.abc import Iterable, Iterator
from itertools import combinations

import numpy as np

from miburi.hardware.build import Solid, link_frames
from miburi.hardware.dimensions import dimensions
from miburi.hardware.solids import Manifold, join, moved
from miburi.robot import Robot
from miburi.robot.description import JOINTS, Array
from miburi.robot.shape import Link, links

#: The largest overlap that does not count, mm³.
_TOUCH = 0.5
#: The step between two poses of a joint, rad.
_STEP = 0.12


def by_link(things: Iterable[Solid]) -> dict[str, list[Solid]]:
    """Return the solids of each link, in the link's frame."""
    table: dict[str, list[Solid]] = {}
    for thing in things:
        table.setdefault(thing.link, []).append(thing)
    return table


def in_one_link(table: dict[str, list[Solid]]) -> Iterator[tuple[str, str]]:
    """Yield the pairs of solids in the same link that overlap."""
    for things in table.values():
        for one, other in combinations(things, 2):
            if (one.solid ^ other.solid).volume() > _TOUCH:
                yield one.name, other.name


def _whole(table: dict[str, list[Solid]]) -> dict[str, Manifold]:
    return {link: join(thing.solid for thing in things) for link, things in table.items()}


def _meet(one: Manifold, other: Manifold) -> bool:
    low, high = np.array(one.bounding_box()), np.array(other.bounding_box())
    apart = (low[:3] >= high[3:]).any() or (high[:3] >= low[3:]).any()
    return not apart and (one ^ other).volume() > _TOUCH


def over_the_range(
    robot: Robot, table: dict[str, list[Solid]], beyond: float = 0.0
) -> Iterator[tuple[str, float]]:
    """Yield the joint and the angle, in rad, at which a link meets the link that carries it.

    Each joint is turned through its range, and by ``beyond`` rad more at both ends, while all other
    joints are at neutral.
    """
    whole = _whole(table)
    for link in links(robot):
        number = JOINTS.index(link.joint)
        low, high = robot.lower[number] - beyond, robot.upper[number] + beyond
        count = int(np.ceil((high - low) / _STEP)) + 1
        for angle in np.linspace(low, high, count).tolist():
            if _meets_parent(robot, whole, link, angle):
                yield link.joint, angle


def _meets_parent(robot: Robot, whole: dict[str, Manifold], link: Link, angle: float) -> bool:
    pose = np.array(robot.neutral)
    pose[JOINTS.index(link.joint)] = angle
    frames = link_frames(robot, pose)
    return _meet(*(moved(whole[name], frames[name]) for name in (link.name, link.parent)))


def stops_hold(robot: Robot, table: dict[str, list[Solid]]) -> Iterator[tuple[str, float]]:
    """Yield each joint, with its angle in rad, that no stop holds 9° beyond its range."""
    whole = _whole(table)
    far = np.radians(dimensions().wall.stop + 2.5)
    for link in links(robot):
        number = JOINTS.index(link.joint)
        for angle in (robot.lower[number] - far, robot.upper[number] + far):
            if not _meets_parent(robot, whole, link, float(angle)):
                yield link.joint, float(angle)


def in_poses(
    robot: Robot, table: dict[str, list[Solid]], poses: Iterable[Array]
) -> Iterator[tuple[str, str]]:
    """Yield the pairs of links that meet in any of the poses, each pair only once.

    A pose has eight angles in rad. Links joined by one joint are left to :func:`over_the_range`.
    """
    whole = _whole(table)
    joined = {frozenset((link.name, link.parent)) for link in links(robot)}
    pairs = [pair for pair in combinations(whole, 2) if frozenset(pair) not in joined]
    for pose in poses:
        frames = link_frames(robot, pose)
        placed = {link: moved(solid, frames[link]) for link, solid in whole.items()}
        for pair in [pair for pair in pairs if _meet(placed[pair[0]], placed[pair[1]])]:
            pairs.remove(pair)
            yield pair
