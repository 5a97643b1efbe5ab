import numpy as np
import pytest

from miburi import ik
from miburi.errors import InputError
from miburi.robot import forward, inverse, iphonoid

ROBOT = iphonoid()


def random_poses(count, seed=0):
    return np.random.default_rng(seed).uniform(ROBOT.lower, ROBOT.upper, (count, 8))


class TestSolve:
    def test_reaches_random_targets_inside_the_limits(self):
        for target in forward(ROBOT, random_poses(200)):
            solution = ik.solve(ROBOT, target)
            assert solution.status == ik.CONVERGED
            miss = (forward(ROBOT, solution.angles) - target).reshape(3, 3)
            assert np.all(np.linalg.norm(miss, axis=1) <= 1e-4)
            assert np.allclose(np.linalg.norm(miss, axis=1), solution.error, atol=1e-12)
            assert np.all(solution.angles >= ROBOT.lower)
            assert np.all(solution.angles <= ROBOT.upper)

    def test_says_that_a_target_is_out_of_reach(self):
        target = forward(ROBOT, ROBOT.neutral)
        target[1] -= 0.5
        solution = ik.solve(ROBOT, target)
        assert solution.status == ik.OUT_OF_REACH
        assert solution.residual > 0.3

    def test_takes_of_several_valid_poses_the_nearest_to_the_present_one(self):
        several = 0
        for pose in random_poses(100, seed=1):
            target = forward(ROBOT, pose)
            poses = inverse(ROBOT, target)
            several += len(poses) > 1
            for present in poses:
                angles = ik.solve(ROBOT, target, start=present).angles
                assert np.allclose(angles, present, atol=1e-3)
        assert several > 10

    @pytest.mark.parametrize("bad", [np.full(9, np.nan), np.zeros(8), "left", [np.inf] * 9])
    def test_refuses_what_is_no_target(self, bad):
        with pytest.raises(InputError, match="target"):
            ik.solve(ROBOT, bad)


class TestBatch:
    def test_answers_as_one_by_one(self):
        targets = forward(ROBOT, random_poses(300, seed=2))
        targets[::10, 0] += 0.3
        together = ik.solve_batch(ROBOT, targets, seed=5)
        assert len(together) == 300
        for i, target in enumerate(targets):
            alone = ik.solve(ROBOT, target, seed=5)
            assert alone.angles.tobytes() == together[i].angles.tobytes()
            assert (alone.status, alone.evaluations) == (
                together[i].status,
                together[i].evaluations,
            )

    def test_of_nothing_is_nothing(self):
        assert len(ik.solve_batch(ROBOT, np.empty((0, 9)))) == 0
