"""The closed-form inverse: every joint solution for a reachable target, exactly.

It uses the structure of this body (the head alone fixes the waist; each arm is then a planar
two-link chain that swings about its shoulder), so it is the truth that tests compare with and
the limit of speed. The Bacterial Memetic Algorithm needs no such structure.
"""

from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from miburi.errors import InputError
from miburi.robot.description import Array, Robot
from miburi.robot.kinematics import checked, forward

__all__ = ["inverse", "inverse_within_limits"]

_ANGLE_TOLERANCE = 1e-7  # rad; a solution this far outside a limit is put on the limit


def inverse(robot: Robot, target: ArrayLike, tolerance: float = 1e-6) -> Array:
    """All poses inside the limits that put hands and head on ``target``.

    Parameters
    ----------
    robot
        Gives lengths and limits.
    target
        (9,) m: right x y z, left x y z, head x y z in the base frame.
    tolerance
        Largest distance of an extremity from its target, in m.

    Returns
    -------
    (k, 8) rad, k from 0 (out of reach) to 16. The paper expects a single solution; with a
    fingertip angle below 0.174 rad the elbow-mirrored arm is inside the limits too. Where a
    hand lies on the shoulder axis any shoulder angle will do: the neutral one is given.

    Raises
    ------
    InputError
        The shape is not (9,), or a value is not finite.
    """
    goal, poses = _poses(robot, target)
    within = np.all(
        (poses >= robot.lower - _ANGLE_TOLERANCE) & (poses <= robot.upper + _ANGLE_TOLERANCE),
        axis=1,
    )
    poses = np.unique(np.clip(poses[within], robot.lower, robot.upper), axis=0)
    exact: Array = poses[np.all(_misses(robot, poses, goal) <= tolerance, axis=1)]
    return exact


def inverse_within_limits(robot: Robot, target: ArrayLike) -> Array:
    """One pose inside the limits, (8,) rad, near a target that the limits do not allow (ours).

    Each joint of the closed-form solutions is put on the limit that it passes; the pose whose
    extremities then miss the target least is given. :func:`miburi.ik.solve` finds a nearer one.

    Raises
    ------
    InputError
        The shape is not (9,), or a value is not finite.
    """
    goal, poses = _poses(robot, target)
    poses = np.clip(poses, robot.lower, robot.upper)
    best: Array = poses[_misses(robot, poses, goal).sum(axis=1).argmin()]
    return best


def _misses(robot: Robot, poses: Array, goal: Array) -> Array:
    """Return how far the extremities are from their targets, (k, 3) m."""
    misses: Array = np.linalg.norm((forward(robot, poses) - goal).reshape(-1, 3, 3), axis=2)
    return misses


def _poses(robot: Robot, target: ArrayLike) -> tuple[Array, Array]:
    """Return the checked target, (9,) m, and all solutions, (16, 8) rad, limits not applied."""
    goal = checked(target, 9, "target")
    if goal.ndim != 1:
        raise InputError(f"target must have the shape (9,), got {goal.shape}.")
    size = robot.lengths
    right, left, head = goal[0:3], goal[3:6], goal[6:9]
    waist = np.arctan2(head[1], head[0])
    rise = (head[2] - size.L01 - size.LH1) / size.LH2
    nod = np.arctan2(rise, np.hypot(head[0], head[1]) / size.LH2)
    turned_left = np.array([-np.sin(waist), np.cos(waist), 0.0])
    fwd = np.array([np.cos(waist), np.sin(waist), 0.0])
    right_arms = _arm_solutions(robot, right, -turned_left, fwd, robot.neutral[1])
    left_arms = _arm_solutions(robot, left, turned_left, fwd, robot.neutral[4])
    poses = np.array(
        [
            [waist, rs, re, rf, ls, -le, -lf, nod]
            for (rs, re, rf), (ls, le, lf) in product(right_arms, left_arms)
        ]
    )
    return goal, poses


def _arm_solutions(
    robot: Robot, hand: Array, lat: Array, fwd: Array, free_shoulder: float
) -> list[tuple[float, float, float]]:
    """(S, E, F) of an arm whose E and F are positive inwards, limits not applied."""
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
        solutions.append((_wrapped(s), _wrapped(e), f))
    return solutions


def _wrapped(angle: float) -> float:
    return float((angle + np.pi) % (2 * np.pi) - np.pi)
