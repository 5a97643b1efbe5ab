"""The coordinates in which gestures are written, blended and varied (Section 4 of the paper).

A pose is eight polar coordinates, in the order of ``COORDINATES``: for each hand, the distance from
its own shoulder, its spread and its swing; for the head, its turn and its rise. Half-way between
two poses, the hands are half-way along an arc, not on a chord through the body. Distances are
multiples of the arm's reach, so a gesture looks the same on a robot of another size.

:func:`targets` turns polar coordinates into the paper's nine coordinates, from which the inverse
kinematics computes angles. Positions out of reach are allowed: the solver returns the closest
reachable pose.
"""

import numpy as np

from miburi.robot import Array, Robot, forward
from miburi.robot.geometry import arm_reach, head_joint, shoulders

#: Distance as a multiple of the arm's reach, angles in rad. Spread is the angle to the shoulders'
#: axis (0 is straight out). Swing is the angle about that axis: 0 for a hanging arm, positive
#: forwards and up. Turn is to the left, rise is up.
COORDINATES = (
    *("right_distance", "right_spread", "right_swing"),
    *("left_distance", "left_spread", "left_swing"),
    *("head_turn", "head_rise"),
)


def polar(right: Array, left: Array, head: Array) -> Array:
    """Return the eight polar coordinates of a pose.

    ``right`` and ``left`` are the hands' positions relative to their own shoulders: forward, out
    and up in the chest's frame, in multiples of the arm's reach. ``head`` is a vector of any length
    from the head's joint to the head: forward, left and up in the base frame.
    """
    turn = np.arctan2(head[1], head[0])
    rise = np.arctan2(head[2], np.hypot(head[0], head[1]))
    return np.array([*_hand(right), *_hand(left), turn, rise])


def neutral(robot: Robot) -> Array:
    """Return the eight polar coordinates of a robot's neutral pose."""
    return polar(*relative(robot, robot.neutral))


def relative(robot: Robot, angles: Array) -> tuple[Array, Array, Array]:
    """Return right hand, left hand and head for :func:`polar`, from a pose's angles in rad."""
    right, left, head = forward(robot, angles).reshape(3, 3)
    look = head - head_joint(robot)
    back = _turn(np.arctan2(look[1], look[0])).T
    right_shoulder, left_shoulder = shoulders(robot)
    return (
        (back @ right - right_shoulder) / arm_reach(robot) * [1, -1, 1],
        (back @ left - left_shoulder) / arm_reach(robot),
        look,
    )


def targets(robot: Robot, coordinates: Array) -> Array:
    """Return x, y and z of the right hand, left hand and head in the base frame, in m."""
    turn, rise = coordinates[6:]
    chest, reach = _turn(turn), arm_reach(robot)
    right_shoulder, left_shoulder = shoulders(robot)
    look = np.array([np.cos(turn) * np.cos(rise), np.sin(turn) * np.cos(rise), np.sin(rise)])
    return np.concatenate(
        [
            chest @ (right_shoulder + reach * _place(coordinates[:3]) * [1, -1, 1]),
            chest @ (left_shoulder + reach * _place(coordinates[3:6])),
            head_joint(robot) + robot.lengths.LH2 * look,
        ]
    )


def _hand(place: Array) -> tuple[float, float, float]:
    ahead, out, up = place
    away = np.hypot(ahead, up)
    swing = np.arctan2(ahead, -up)
    # The swing increases from pointing back, through hanging down and pointing forward, to pointing
    # up. It wraps at straight back, which is out of reach.
    swing = (swing + np.pi / 2) % (2 * np.pi) - np.pi / 2
    return np.hypot(away, out), np.arctan2(away, out), swing


def _place(hand: Array) -> Array:
    distance, spread, swing = hand
    away = distance * np.sin(spread)
    return np.array([away * np.sin(swing), distance * np.cos(spread), -away * np.cos(swing)])


def _turn(angle: float) -> Array:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
