"""Moves that somebody asks for: the iphonoid and a robot with longer arms can do them."""

from pathlib import Path

import numpy as np
import pytest

from miburi.bodies.rehearsal import rehearse
from miburi.robot import Robot, forward, load_robot
from miburi.talk.moves import MOVES, move


@pytest.fixture(scope="module")
def tall(tall_file: Path) -> Robot:
    return load_robot(tall_file)


@pytest.mark.parametrize("name", MOVES)
def test_a_move_ends_at_neutral_and_meets_nothing(robot: Robot, tall: Robot, name: str) -> None:
    for body in (robot, tall):
        tried = rehearse(body, move(body, name))
        assert (tried.met, tried.stop) == (None, None)
        assert body is not robot or tried.ik_error < 1e-3
    poses = move(robot, name)
    neutral = forward(robot, robot.neutral)
    assert np.allclose(poses[-1].target, neutral)
    assert max(np.abs(pose.target - neutral).max() for pose in poses) > 0.01, "it can be seen"


def test_lifted_arms_are_up_and_a_wave_goes_to_and_fro(robot: Robot) -> None:
    neutral = forward(robot, robot.neutral).reshape(3, 3)
    up = move(robot, "lift")[0].target.reshape(3, 3)
    assert (up[:2, 2] > neutral[:2, 2] + 0.1).all()
    waves = np.array([pose.target[:3] for pose in move(robot, "wave")[:-1]])
    assert (np.abs(np.diff(waves[:, 1])) > 0.02).sum() >= 4
    one = move(robot, "lift_right")[0].target.reshape(3, 3)
    assert one[0, 2] > neutral[0, 2] + 0.1
    assert np.allclose(one[1], neutral[1], atol=0.01)
