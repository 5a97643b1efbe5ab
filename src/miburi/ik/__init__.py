"""Inverse kinematics: solve nine coordinates for eight angles, exactly or with the paper's BMA.

>>> from miburi import ik
>>> from miburi.robot import forward, iphonoid
>>> robot = iphonoid()
>>> ik.solve(robot, forward(robot, robot.neutral)).status
'converged'
"""

from miburi.bma.settings import BUDGET_SPENT, CONVERGED, DEADLINE
from miburi.ik.problem import FARTHEST, REACHED, TOLERANCE
from miburi.ik.solver import (
    NEAR,
    OUT_OF_REACH,
    Solution,
    Solutions,
    residual_settings,
    solve,
    solve_batch,
)

__all__ = [
    "BUDGET_SPENT",
    "CONVERGED",
    "DEADLINE",
    "FARTHEST",
    "NEAR",
    "OUT_OF_REACH",
    "REACHED",
    "TOLERANCE",
    "Solution",
    "Solutions",
    "residual_settings",
    "solve",
    "solve_batch",
]
