"""Which inverse kinematics a partner uses."""

from collections.abc import Callable

from miburi import ik
from miburi.bma.settings import Settings
from miburi.robot import Array, Robot

__all__ = ["Solve", "solve_with"]

Solve = Callable[[Robot, Array, Array], ik.Solution]


def solve_with(settings: Settings | None = None) -> Solve:
    """Return the inverse kinematics with these settings; by default :func:`ik.solve`."""
    return lambda robot, target, start: ik.solve(robot, target, start=start, settings=settings)
