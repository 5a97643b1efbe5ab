"""Grooves into which a board slides."""

from miburi.hardware.solids import (
    Manifold,
    box,
    cut,
)

__all__ = ["grooves"]


def grooves(
    x: float, half: float, floor: float, high: float, behind: float = 0.0
) -> list[Manifold]:
    """Return two posts; a 1.6 mm board slides down between them, from y = -half to half.

    They reach ``behind`` mm further back, to a wall that carries them.
    """
    return [
        cut(
            box(
                (x - 2.3 - behind, x + 2.3),
                (side * (half - 1.5), side * (half + 2.0)),
                (floor - 2.0, high),
            ),
            [
                box(
                    (x - 0.95, x + 0.95),
                    (side * (half - 2.0), side * (half + 0.3)),
                    (floor, high + 1),
                )
            ],
        )
        for side in (-1, 1)
    ]
