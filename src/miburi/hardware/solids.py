"""Build solids from a few kinds: boxes, rods, balls, hulls and letters, in mm.

The kernel is manifold3d: every solid it returns is closed. Axes are ``x``, ``y`` and ``z``.
"""

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from miburi.errors import needs_extra
from miburi.robot.description import Array

try:
    from manifold3d import CrossSection, FillRule, JoinType, Manifold, OpType
except ModuleNotFoundError as error:
    raise needs_extra("hardware", error) from error

__all__ = [
    "CrossSection",
    "JoinType",
    "Manifold",
    "Numbers",
    "around",
    "ball",
    "box",
    "cut",
    "disc",
    "discs",
    "hull",
    "join",
    "letters",
    "mirror_y",
    "moved",
    "rod",
]

#: A point, a direction or the ends of a span.
Numbers = Sequence[float] | Array

#: How many straight edges make up a large circle: with these, a 16 mm hole is round within 0.02 mm.
_ROUND = 64


def _edges(radius: float) -> int:
    return _ROUND if radius > 4 else 24


def box(x: Numbers, y: Numbers, z: Numbers) -> Manifold:
    """Return a box between two values on each axis."""
    low, high = np.sort(np.array([x, y, z], dtype=float), axis=1).T
    return Manifold.cube((high - low).tolist()).translate(low.tolist())


def rod(start: Numbers, end: Numbers, radius: float) -> Manifold:
    """Return a cylinder from one point to another."""
    a, b = np.array(start, dtype=float), np.array(end, dtype=float)
    way = b - a
    length = float(np.linalg.norm(way))
    solid = Manifold.cylinder(length, radius, radius, _edges(radius))
    return solid.transform(_frame(way / length, a))


def disc(axis: str, middle: Numbers, span: Numbers, radius: float) -> Manifold:
    """Return a cylinder along an axis: its ends are in ``span``, its centre at ``middle``."""
    index = "xyz".index(axis)
    start, end = (np.insert(np.array(middle, dtype=float), index, place) for place in span)
    return rod(start, end, radius)


def discs(axis: str, middles: Iterable[Numbers], span: Numbers, radius: float) -> list[Manifold]:
    """Return equal cylinders at several places; see :func:`disc`."""
    return [disc(axis, middle, span, radius) for middle in middles]


def ball(middle: Numbers, radius: float) -> Manifold:
    """Return a sphere."""
    return Manifold.sphere(radius, _edges(radius)).translate(list(middle))


def hull(*solids: Manifold) -> Manifold:
    """Return the smallest convex solid that encloses the given solids."""
    return Manifold.batch_hull(list(solids))


def join(solids: Iterable[Manifold]) -> Manifold:
    """Return the union of solids."""
    return Manifold.batch_boolean(list(solids), OpType.Add)


def cut(solid: Manifold, tools: Iterable[Manifold]) -> Manifold:
    """Return a solid with others cut out of it."""
    return Manifold.batch_boolean([solid, *tools], OpType.Subtract)


def moved(solid: Manifold, frame: Array) -> Manifold:
    """Return a solid rotated and translated by ``frame``, a matrix of shape (3, 4)."""
    return solid.transform(frame)


def mirror_y(solid: Manifold) -> Manifold:
    """Return a solid mirrored left to right, for the robot's other side."""
    return solid.mirror((0.0, 1.0, 0.0))


def around(
    low: float, high: float, make: Callable[[float], CrossSection], step: float = 0.05
) -> CrossSection:
    """Return the area that an outline sweeps while it turns from ``low`` to ``high``, in rad."""
    count = max(2, int(np.ceil((high - low) / step)) + 1)
    return CrossSection.batch_boolean(
        [make(float(angle)) for angle in np.linspace(low, high, count)], OpType.Add
    )


def letters(text: str, height: float, depth: float) -> Manifold:
    """Return letters that stand on the xy plane, centred, ``height`` tall and ``depth`` thick."""
    from matplotlib.textpath import TextPath

    outlines = TextPath((0, 0), text, size=height / 0.73).to_polygons()
    flat = CrossSection([np.asarray(outline)[:-1] for outline in outlines], FillRule.EvenOdd)
    left, bottom, right, top = flat.bounds()
    return flat.translate((-(left + right) / 2, -(bottom + top) / 2)).extrude(depth)


def _frame(direction: Array, origin: Array) -> Array:
    """Return a frame, (3, 4), whose z axis is ``direction``, which has length 1."""
    aside = np.eye(3)[int(np.argmin(np.abs(direction)))]
    x = np.cross(aside, direction)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(direction, x), direction, origin])
