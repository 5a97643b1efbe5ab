"""The geometry agrees with the kinematics."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from miburi.robot import JOINTS, Robot, forward, iphonoid
from miburi.robot.geometry import arm_reach, hand_distances, head_joint, shoulders
from miburi.robot.shape import extremities, links


def with_fingertips(right: tuple[float, float], left: tuple[float, float]) -> Robot:
    """Return a robot with other arm lengths and with these limits of the fingertip joints."""
    data = iphonoid().model_dump()
    data["lengths"] |= {"L12": 0.07, "L23": 0.05}
    for name, (low, high) in {"right_fingertip": right, "left_fingertip": left}.items():
        data["joints"][name] |= {"min": low, "max": high, "neutral": (low + high) / 2}
    return Robot.model_validate(data)


ROBOTS = [
    iphonoid(),
    with_fingertips((-0.2, 2.0), (-2.5, 0.4)),
    with_fingertips((0.3, 1.2), (-1.4, -0.6)),
]


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_straight_arm_ends_at_its_reach_from_the_shoulder(robot: Robot) -> None:
    right, left, head = forward(robot, np.zeros(8)).reshape(3, 3)
    out = np.array([[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]])
    assert_allclose([right, left], shoulders(robot) + arm_reach(robot) * out, atol=1e-15)
    assert_allclose(head, head_joint(robot) + np.array([robot.lengths.LH2, 0, 0]), atol=1e-15)


@pytest.mark.parametrize("robot", ROBOTS)
def test_hands_reach_their_least_and_greatest_distance_from_the_shoulders(robot: Robot) -> None:
    angles = np.tile(robot.neutral, (2001, 1))
    angles[:, 0] = 0.0
    for name in ("right_fingertip", "left_fingertip"):
        joint = JOINTS.index(name)
        angles[:, joint] = np.linspace(robot.lower[joint], robot.upper[joint], len(angles))
    hands = forward(robot, angles)[:, :6].reshape(-1, 2, 3)
    away = np.linalg.norm(hands - shoulders(robot), axis=2)
    assert_allclose(hand_distances(robot), np.column_stack([away.min(0), away.max(0)]), atol=1e-7)


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_links_have_the_same_joints(robot: Robot) -> None:
    at = {"base_link": np.zeros(3)}
    for link in links(robot):
        at[link.name] = at[link.parent] + link.position
    assert_allclose([at["right_shoulder"], at["left_shoulder"]], shoulders(robot))
    places = [at[link] + point for link, point in extremities(robot).values()]
    assert_allclose(np.concatenate(places), forward(robot, np.zeros(8)), atol=1e-15)
