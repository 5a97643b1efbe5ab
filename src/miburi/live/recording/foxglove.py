"""The robot in Foxglove's schemas, so that a recording opens in 3D without configuration.

``foxglove.json`` has two of Foxglove's schemas, without their descriptions: see NOTICE.
"""

import json
from collections.abc import Sequence
from importlib.resources import files
from math import acos, atan2, cos, hypot, sin
from typing import Any

from miburi.robot import Robot
from miburi.robot.shape import COLOURS, LinkFrame, Part, Point, fixed_frames, frames, links, parts

#: The schemas, keyed by name.
SCHEMAS: dict[str, dict[str, Any]] = {
    f"foxglove.{name}": schema
    for name, schema in json.loads(
        files(__package__).joinpath("foxglove.json").read_text(encoding="utf-8")
    ).items()
}
_SECOND = 1_000_000_000
_STRAIGHT = (0.0, 0.0, 0.0, 1.0)
_KINDS = ("arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models")


class Transforms:
    """Makes ``foxglove.FrameTransforms``: the position and orientation of each link."""

    def __init__(self, robot: Robot) -> None:
        self._links, self._fixed = links(robot), fixed_frames(robot)

    def at(self, wall: int, angles: Sequence[float]) -> dict[str, Any]:
        """Return the message for a time in ns and the eight angles in rad."""
        all_frames = [*frames(self._links, angles), *self._fixed]
        return {"transforms": [_transform(wall, frame) for frame in all_frames]}


def scene(robot: Robot, wall: int) -> dict[str, Any]:
    """Return ``foxglove.SceneUpdate``: the robot's parts, which move with their links."""
    entities: dict[str, dict[str, Any]] = {}
    for part in parts(robot):
        entity = entities.setdefault(part.link, _entity(part.link, wall))
        for kind, primitive in _primitives(part):
            entity[kind].append(primitive)
    return {"deletions": [], "entities": [*entities.values()]}


def _time(wall: int) -> dict[str, int]:
    return {"sec": wall // _SECOND, "nsec": wall % _SECOND}


def _transform(wall: int, frame: LinkFrame) -> dict[str, Any]:
    return {
        "timestamp": _time(wall),
        "parent_frame_id": frame.parent,
        "child_frame_id": frame.child,
        "translation": _point(frame.position),
        "rotation": _turn(frame.turn),
    }


def _entity(link: str, wall: int) -> dict[str, Any]:
    return {
        "timestamp": _time(wall),
        "frame_id": link,
        "id": link,
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": True,
        "metadata": [],
        **{kind: [] for kind in _KINDS},
    }


def _primitives(part: Part) -> list[tuple[str, dict[str, Any]]]:
    """Return a part as Foxglove's solids: a capsule becomes a rod with a ball at each end."""
    colour = dict(zip("rgba", COLOURS[part.colour], strict=True))

    def solid(kind: str, place: Sequence[float], turn: Sequence[float], *size: float) -> Any:
        pose = {"position": _point(place), "orientation": _turn(turn)}
        more = {"bottom_scale": 1.0, "top_scale": 1.0} if kind == "cylinders" else {}
        return kind, {"pose": pose, "size": _point(size), "color": colour, **more}

    across = 2 * part.size[0]
    match part.kind:
        case "box":
            turn = (0.0, -sin(part.tilt / 2), 0.0, cos(part.tilt / 2))
            return [solid("cubes", part.position, turn, *(2 * half for half in part.size))]
        case "ellipsoid":
            return [solid("spheres", part.position, _STRAIGHT, *(2 * half for half in part.size))]
        case "sphere":
            return [solid("spheres", part.position, _STRAIGHT, across, across, across)]
        case _:
            end = part.end or part.position
            length, turn = _along(part.position, end)
            rod = solid("cylinders", part.middle, turn, across, across, length)
            if part.kind == "cylinder":
                return [rod]
            ends = (part.position, end)
            return [rod, *(solid("spheres", at, _STRAIGHT, across, across, across) for at in ends)]


def _along(start: Point, end: Point) -> tuple[float, tuple[float, float, float, float]]:
    """Return a rod's length, and the rotation that maps the z axis onto it."""
    x, y, z = (b - a for a, b in zip(start, end, strict=True))
    length = hypot(x, y, z)
    if not length:
        return 0.0, _STRAIGHT
    half, about = acos(z / length) / 2, atan2(y, x)
    return length, (-sin(half) * sin(about), sin(half) * cos(about), 0.0, cos(half))


def _point(place: Sequence[float]) -> dict[str, float]:
    return dict(zip("xyz", (round(float(one), 5) for one in place), strict=True))


def _turn(turn: Sequence[float]) -> dict[str, float]:
    return dict(zip("xyzw", (round(float(one), 5) for one in turn), strict=True))
