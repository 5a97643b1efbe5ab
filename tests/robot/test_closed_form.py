"""The closed form finds every solution, and only solutions."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from miburi.errors import InputError
from miburi.robot import forward, inverse, inverse_within_limits, iphonoid

ROBOT = iphonoid()


def random_poses(count: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(ROBOT.lower, ROBOT.upper, (count, 8))


def test_it_finds_the_drawn_pose_and_only_valid_ones() -> None:
    for q in random_poses(500, 1):
        target = forward(ROBOT, q)
        found = inverse(ROBOT, target)
        assert np.abs(found - q).max(axis=1).min() < 1e-6
        assert_allclose(forward(ROBOT, found), np.tile(target, (len(found), 1)), atol=1e-6)
        assert np.all((found >= ROBOT.lower) & (found <= ROBOT.upper))


def test_how_unique_the_solution_is() -> None:
    """The paper expects one; 31 % of random targets have more, by the mirrored elbow."""
    q = random_poses(2000, 0)
    counts = np.array([len(inverse(ROBOT, forward(ROBOT, pose))) for pose in q])
    assert 0.28 < np.mean(counts > 1) < 0.34
    # With elbow and fingertip bent inwards only, it is the paper's single one.
    low, high = ROBOT.lower.copy(), ROBOT.upper.copy()
    low[[1, 4]], low[[2, 3]], high[[5, 6]] = 0.0, 0.18, -0.18
    inwards = np.random.default_rng(0).uniform(low, high, (500, 8))
    assert all(len(inverse(ROBOT, forward(ROBOT, pose))) == 1 for pose in inwards)


def test_limits_themselves_are_reached() -> None:
    for corner in (ROBOT.lower, ROBOT.upper, ROBOT.neutral):
        found = inverse(ROBOT, forward(ROBOT, corner))
        assert np.abs(found - corner).max(axis=1).min() < 1e-6


def test_a_hand_on_the_shoulder_axis_leaves_the_shoulder_free() -> None:
    straight_out = np.array([0, 1.0, 0, 0, 1.0, 0, 0, 0.8])
    found = inverse(ROBOT, forward(ROBOT, straight_out))
    assert len(found) > 0
    assert_allclose(found[:, 1], ROBOT.neutral[1])


@pytest.mark.parametrize("index", [0, 3, 8])
def test_out_of_reach_gives_no_pose(index: int) -> None:
    target = forward(ROBOT, ROBOT.neutral)
    target[index] += 1.0
    assert inverse(ROBOT, target).shape == (0, 8)


def test_beyond_the_limits_there_is_a_pose_within_them() -> None:
    inside = random_poses(100, 3)
    for q in inside:
        target = forward(ROBOT, q)
        assert_allclose(forward(ROBOT, inverse_within_limits(ROBOT, target)), target, atol=1e-6)
    for q in np.random.default_rng(4).uniform(-np.pi, np.pi, (100, 8)):
        bent = inverse_within_limits(ROBOT, forward(ROBOT, q))
        assert np.all((bent >= ROBOT.lower) & (bent <= ROBOT.upper))


def test_nonsense_is_refused() -> None:
    for wrong in (np.zeros(8), np.full(9, np.nan), np.zeros((2, 9))):
        with pytest.raises(InputError, match="target must"):
            inverse(ROBOT, wrong)
