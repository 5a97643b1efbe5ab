"""The convex hull of points in space, and its volume."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Faces = NDArray[np.int64]

#: Points are put on a grid of this many steps across while the hull is found: every product of
#: three coordinates is then a whole number that a float64 holds exactly, so no face is lost.
_GRID = 40_000


def hull_volume(points: Array) -> float:
    """Return the volume of the convex hull of ``points``, (n, 3) m, in m³; 0 where they are flat.

    The hull grows by points far outside: the faces that such a point sees give way to
    faces from it to their rim (Barber, Dobkin and Huhdanpaa, The quickhull algorithm for convex
    hulls, ACM TOMS 22, 1996). Points closer than 1/40 000 of the whole are one.
    """
    span = float(np.ptp(points, axis=0).max())
    if span == 0:
        return 0.0
    grid = np.rint((points - points.min(axis=0)) * (_GRID / span))
    faces = _tetrahedron(grid)
    if faces is None:
        return 0.0
    normals, heights = _planes(grid, faces)
    alive = np.ones(len(faces), dtype=bool)
    # Each point that is still outside belongs to one face that it sees.
    outside, owner = _sorted_out(grid, np.arange(len(grid)), normals, heights, 0)
    while len(outside):
        tip = int(outside[-1])
        seen = alive & (normals @ grid[tip] > heights)
        new = _cone(faces[seen], tip)
        new_normals, new_heights = _planes(grid, new)
        orphaned = seen[owner]
        adopted, adopter = _sorted_out(
            grid, outside[orphaned], new_normals, new_heights, len(faces)
        )
        outside = np.concatenate([adopted, outside[~orphaned]])
        owner = np.concatenate([adopter, owner[~orphaned]])
        faces = np.vstack([faces, new])
        normals = np.vstack([normals, new_normals])
        heights = np.concatenate([heights, new_heights])
        alive = np.concatenate([alive & ~seen, np.ones(len(new), dtype=bool)])
    faces = faces[alive]
    corners = points[faces] - points[faces[0, 0]]
    return float(np.linalg.det(corners).sum() / 6)


def _sorted_out(
    grid: Array, points: Faces, normals: Array, heights: Array, first: int
) -> tuple[Faces, Faces]:
    """Return those of ``points`` that see a face, farthest last, and which, counted from first."""
    above = grid[points] @ normals.T - heights
    highest = above.argmax(axis=1)
    height = above[np.arange(len(points)), highest]
    order = np.argsort(height, kind="stable")
    order = order[height[order] > 0]
    return points[order], first + highest[order]


def _tetrahedron(grid: Array) -> Faces | None:
    """Return the four faces of a body, corners counter-clockwise seen from outside."""
    first = int(np.argmin(grid[:, 0]))
    away = grid - grid[first]
    second = int(np.argmax((away**2).sum(axis=1)))
    normals = np.cross(away[second], away)
    third = int(np.argmax((normals**2).sum(axis=1)))
    heights = away @ normals[third]
    fourth = int(np.argmax(np.abs(heights)))
    if heights[fourth] == 0:
        return None
    a, b, c, d = first, second, third, fourth
    if heights[fourth] > 0:
        b, c = c, b
    return np.array([[a, b, c], [a, d, b], [b, d, c], [c, d, a]])


def _planes(grid: Array, faces: Faces) -> tuple[Array, Array]:
    """Return outward normals (m, 3) of any length, and heights (m,), of faces (m, 3)."""
    a, b, c = grid[faces[:, 0]], grid[faces[:, 1]], grid[faces[:, 2]]
    normals = np.cross(b - a, c - a)
    return normals, (normals * a).sum(axis=1)


def _cone(seen: Faces, tip: int) -> Faces:
    """Return the faces from the rim of ``seen`` to ``tip``; inner edges run in both ways."""
    edges = {edge for a, b, c in seen.tolist() for edge in ((a, b), (b, c), (c, a))}
    rim = [(a, b, tip) for a, b in edges if (b, a) not in edges]
    return np.array(sorted(rim))
