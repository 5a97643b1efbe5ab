"""Positions of a robot's joints, and the reach of its arms.

The functions take a :class:`~miburi.robot.Robot` and return distances, or positions in the base
frame (x forward, y to the robot's left, z up, the waist at 0), in m.
"""

import numpy as np

from miburi.robot.description import JOINTS, Array, Robot


def shoulders(robot: Robot) -> Array:
    """Return the positions of the right and the left shoulder, (2, 3) m."""
    size = robot.lengths
    return np.array([[0.0, -size.L12, size.L01], [0.0, size.L12, size.L01]])


def head_joint(robot: Robot) -> Array:
    """Return the position of the joint that nods the head, (3,) m."""
    return np.array([0.0, 0.0, robot.lengths.L01 + robot.lengths.LH1])


def arm_reach(robot: Robot) -> float:
    """Return the length of a straight arm from the shoulder to the hand, in m."""
    return robot.lengths.L23 + robot.lengths.L34


def hand_distances(robot: Robot) -> Array:
    """Return the least and the greatest distance of each hand from its shoulder, (2, 2) m.

    The rows are right and left. The distances follow from the limits of the fingertip joints.
    """
    size = robot.lengths
    fingertips = [JOINTS.index("right_fingertip"), JOINTS.index("left_fingertip")]
    lower, upper = robot.lower[fingertips], robot.upper[fingertips]
    most_bent = np.maximum(-lower, upper)
    least_bent = np.maximum(0.0, np.maximum(lower, -upper))
    bends = np.cos(np.column_stack([most_bent, least_bent]))
    distances: Array = np.sqrt(size.L23**2 + size.L34**2 + 2 * size.L23 * size.L34 * bends)
    return distances
