import numpy as np
import pytest

from miburi.bodies.rehearsal import PERIOD, rehearse
from miburi.gestures import KeyPose, blend, key_poses, load
from miburi.robot import forward


def test_a_hold_is_held(robot):
    start = forward(robot, robot.neutral)
    raised = forward(robot, robot.neutral + np.array([0, 0.5, 0, 0, 0.5, 0, 0, 0]))
    poses = [KeyPose(*raised.reshape(3, 3), 0.5, 1.0), KeyPose(*start.reshape(3, 3), 0.5)]
    rehearsal = rehearse(robot, poses)
    there = np.linalg.norm(rehearsal.positions[:, :3] - raised[:3], axis=1) < 0.003
    assert there.sum() * PERIOD == pytest.approx(1.0, abs=0.2)
    assert rehearsal.stop is None
    assert rehearsal.ik_error < 1e-4


def test_the_same_performance_twice_is_the_same_motion(robot):
    one, two = (rehearse(robot, key_poses(robot, load("anger"), 0.9)) for _ in range(2))
    assert np.array_equal(one.angles, two.angles)


def test_arms_that_cross_are_noticed(robot):
    crossed = forward(robot, [0, 1.2, 1.7, 0.9, 1.2, -1.7, -0.9, 0.8])
    rehearsal = rehearse(robot, [KeyPose(*crossed.reshape(3, 3), 1.0)])
    assert rehearsal.met is not None
    assert rehearsal.self_collisions > 0


@pytest.mark.parametrize("seed", range(2))
def test_blends_run_freely(robot, seed):
    mixed = blend(robot, [(load("happiness"), 0.7), (load("surprise"), 0.5)], variation=seed)
    rehearsal = rehearse(robot, mixed)
    assert rehearsal.stop is None
    assert rehearsal.met is None
