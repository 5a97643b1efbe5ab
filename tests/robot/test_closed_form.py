"""The closed form finds every solution, and only solutions."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from miburi.errors import InputError
from miburi.robot import forward, inverse, iphonoid

ROBOT = iphonoid()


def random_poses(count: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(ROBOT.lower, ROBOT.upper, (count, 8))


def test_it_finds_the_original_pose_and_only_valid_ones() -> None:
    for q in random_poses(100, 1):
        target = forward(ROBOT, q)
        solutions = inverse(ROBOT, target)
        assert np.abs(solutions - q).max(axis=1).min() < 1e-6
        assert_allclose(forward(ROBOT, solutions), np.tile(target, (len(solutions), 1)), atol=1e-6)
        assert np.all((solutions >= ROBOT.lower) & (solutions <= ROBOT.upper))


def test_a_third_of_random_targets_have_several_solutions() -> None:
    """The paper expects one; 31 % of random targets have more, by the mirrored elbow."""
    counts = [len(inverse(ROBOT, forward(ROBOT, pose))) for pose in random_poses(500, 0)]
    assert 0.28 < np.mean(np.array(counts) > 1) < 0.34
    # With elbow and fingertip bent inwards only, the solution is unique, as the paper expects.
    low, high = ROBOT.lower.copy(), ROBOT.upper.copy()
    low[[1, 4]], low[[2, 3]], high[[5, 6]] = 0.0, 0.18, -0.18
    inwards = np.random.default_rng(0).uniform(low, high, (50, 8))
    assert all(len(inverse(ROBOT, forward(ROBOT, pose))) == 1 for pose in inwards)


def test_poses_on_the_limits_are_found() -> None:
    for corner in (ROBOT.lower, ROBOT.upper, ROBOT.neutral):
        solutions = inverse(ROBOT, forward(ROBOT, corner))
        assert np.abs(solutions - corner).max(axis=1).min() < 1e-6


def test_a_hand_on_the_shoulder_axis_leaves_the_shoulder_free() -> None:
    straight_out = np.array([0, 1.0, 0, 0, 1.0, 0, 0, 0.8])
    solutions = inverse(ROBOT, forward(ROBOT, straight_out))
    assert len(solutions) > 0
    assert_allclose(solutions[:, 1], ROBOT.neutral[1])


def test_a_head_nodded_over_is_found_too() -> None:
    """Beyond a quarter of a turn the head is behind the waist's bearing; limits may allow that."""
    data = ROBOT.model_dump()
    for joint in data["joints"].values():
        joint |= {"min": -np.pi, "max": np.pi}
    robot = type(ROBOT).model_validate(data)
    turned = 0
    for pose in np.random.default_rng(2).uniform(robot.lower, robot.upper, (50, 8)):
        target = forward(robot, pose)
        found = inverse(robot, target)
        assert np.abs(found - pose).max(axis=1).min() < 1e-6
        assert_allclose(forward(robot, found), np.tile(target, (len(found), 1)), atol=1e-6)
        turned += np.ptp(found[:, 0]) > 1
    assert turned > 5


def test_out_of_reach_there_is_no_pose() -> None:
    """Near or so far that squares overflow; a warning is an error."""
    for far in (1.0, 1e10, 1e154, -1e300):
        for index in (0, 3, 8):
            target = forward(ROBOT, ROBOT.neutral)
            target[index] += far
            assert inverse(ROBOT, target).shape == (0, 8)


def test_wrong_targets_are_refused() -> None:
    masked = np.ma.masked_all(9)
    for wrong in (np.zeros(8), np.full(9, np.nan), np.zeros((2, 9)), np.zeros(9, complex), masked):
        with pytest.raises(InputError, match="target must"):
            inverse(ROBOT, wrong)
