"""Closed-form inverse kinematics: all exact solutions for a target.

It relies on the structure of this body: the head alone fixes the waist, and each arm is then a
planar two-link chain that swings about its shoulder. Tests use it as ground truth, and benchmarks
as the fastest possible solver; nothing else uses it. The project's own solver, the Bacterial
Memetic Algorithm, does not need this structure.
"""

from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from miburi.errors import InputError
from miburi.robot.description import Array, Robot
from miburi.robot.kinematics import finite_array, forward

#: A solution that is outside a limit by no more than this, in rad, is moved onto the limit.
_ANGLE_TOLERANCE = 1e-7


def inverse(robot: Robot, target: ArrayLike, tolerance: float = 1e-6) -> Array:
    """Return all poses inside the limits that put hands and head on ``target``.

    ``target`` has the shape (9,), in m: right x y z, left x y z, head x y z in the base frame.
    ``tolerance`` is how far an extremity may be from its target, in m.

    Returns
    -------
    (k, 8) rad, where k is from 0 (out of reach) to 32. The paper expects a single solution. But if
    a fingertip angle is below 0.174 rad, the arm with the mirrored elbow is inside the limits, too.
    If the head can tilt by more than a quarter of a turn, the pose with the waist turned by π is
    also inside the limits. If a hand lies on the shoulder axis, any shoulder angle is a solution;
    the neutral shoulder angle is returned.

    Raises
    ------
    InputError
        The shape is not (9,), or a value is not finite.
    """
    goal = finite_array(target, 9, "target")
    if goal.ndim != 1:
        raise InputError(f"target must have the shape (9,), got {goal.shape}.")
    if np.abs(goal).max() > sum(vars(robot.lengths).values()):
        return np.empty((0, 8))
    poses = _solutions(robot, goal)
    low, high = robot.lower - _ANGLE_TOLERANCE, robot.upper + _ANGLE_TOLERANCE
    within = np.all((poses >= low) & (poses <= high), axis=1)
    poses = np.unique(np.clip(poses[within], robot.lower, robot.upper), axis=0)
    misses = np.linalg.norm((forward(robot, poses) - goal).reshape(-1, 3, 3), axis=2)
    exact: Array = poses[np.all(misses <= tolerance, axis=1)]
    return exact


def _solutions(robot: Robot, goal: Array) -> Array:
    """Return all solutions, (32, 8) in rad; the joint limits are not applied."""
    size = robot.lengths
    head = goal[6:9]
    bearing = np.arctan2(head[1], head[0])
    rise, ahead = (head[2] - size.L01 - size.LH1) / size.LH2, np.hypot(head[0], head[1]) / size.LH2
    return np.array(
        [
            pose
            for waist, forward_part in ((bearing, ahead), (_wrap(bearing + np.pi), -ahead))
            for pose in _poses(robot, goal, waist, np.arctan2(rise, forward_part))
        ]
    )


def _poses(robot: Robot, goal: Array, waist: float, nod: float) -> list[list[float]]:
    """Return the poses with this waist and nod; the joint limits are not applied."""
    turned_left = np.array([-np.sin(waist), np.cos(waist), 0.0])
    fwd = np.array([np.cos(waist), np.sin(waist), 0.0])
    right_arms = _arm_solutions(robot, goal[0:3], -turned_left, fwd, robot.neutral[1])
    left_arms = _arm_solutions(robot, goal[3:6], turned_left, fwd, robot.neutral[4])
    return [
        [waist, rs, re, rf, ls, -le, -lf, nod]
        for (rs, re, rf), (ls, le, lf) in product(right_arms, left_arms)
    ]


def _arm_solutions(
    robot: Robot, hand: Array, lat: Array, fwd: Array, free_shoulder: float
) -> list[tuple[float, float, float]]:
    """Return an arm's angles (S, E, F), with E and F positive inwards; no limits are applied."""
    size = robot.lengths
    along = hand @ lat - size.L12
    ahead, height = hand @ fwd, hand[2] - size.L01
    swing = np.hypot(ahead, height)
    reach = along**2 + swing**2
    cos_f = (reach - size.L23**2 - size.L34**2) / (2 * size.L23 * size.L34)
    bend = np.arccos(np.clip(cos_f, -1.0, 1.0))
    solutions = []
    for side, f in product((1.0, -1.0), (bend, -bend)):
        out = side * swing
        s = np.arctan2(side * ahead, -side * height) if swing > 1e-12 else free_shoulder
        e = np.arctan2(out, along) - np.arctan2(
            size.L34 * np.sin(f), size.L23 + size.L34 * np.cos(f)
        )
        solutions.append((_wrap(s), _wrap(e), f))
    return solutions


def _wrap(angle: float) -> float:
    return float((angle + np.pi) % (2 * np.pi) - np.pi)
