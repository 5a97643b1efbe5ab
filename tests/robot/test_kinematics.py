"""Forward kinematics against MuJoCo and simple poses, and each misprint of the paper."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from miburi.errors import InputError
from miburi.robot import EXTREMITIES, JOINTS, forward, forward_as_printed, iphonoid, jacobian
from miburi.robot.mjcf import to_mjcf
from miburi.robot.physics import mujoco

ROBOT = iphonoid()
SIZE = ROBOT.lengths
HALF_PI = np.pi / 2


def random_poses(count: int) -> np.ndarray:
    return np.random.default_rng(3).uniform(ROBOT.lower, ROBOT.upper, (count, 8))


def test_forward_equals_mujoco() -> None:
    model = mujoco.MjModel.from_xml_string(to_mjcf(ROBOT))
    data = mujoco.MjData(model)
    places = [model.joint(name).qposadr[0] for name in JOINTS]
    for q in random_poses(50):
        data.qpos[places] = q
        mujoco.mj_kinematics(model, data)
        positions = np.concatenate([data.site(name).xpos for name in EXTREMITIES])
        assert_allclose(forward(ROBOT, q), positions, atol=1e-9)


def test_jacobian_equals_numerical_derivatives() -> None:
    shifts = 1e-6 * np.eye(8)
    for q in random_poses(50):
        numerical = (forward(ROBOT, q + shifts) - forward(ROBOT, q - shifts)).T / 2e-6
        assert_allclose(jacobian(ROBOT, q), numerical, atol=1e-9)


def test_a_batch_equals_single_calls() -> None:
    batch = random_poses(50)
    together = forward(ROBOT, batch)
    assert together.shape == (50, 9)
    np.testing.assert_array_equal(together, [forward(ROBOT, q) for q in batch])
    assert forward(ROBOT, np.empty((0, 8))).shape == (0, 9)


def test_the_arms_point_where_simple_poses_say() -> None:
    """W = 0, F = 0: sideways, hanging, forward, straight up."""
    arm = SIZE.L23 + SIZE.L34
    for elbow, shoulder, hand in [
        (0.0, 0.0, [0, -SIZE.L12 - arm, SIZE.L01]),
        (HALF_PI, 0.0, [0, -SIZE.L12, SIZE.L01 - arm]),
        (HALF_PI, HALF_PI, [arm, -SIZE.L12, SIZE.L01]),
        (HALF_PI, np.pi, [0, -SIZE.L12, SIZE.L01 + arm]),
    ]:
        place = forward(ROBOT, [0, shoulder, elbow, 0, shoulder, -elbow, 0, 0])
        assert_allclose(place[:3], hand, atol=1e-15)
        assert_allclose(place[3:6], np.array(hand) * [1, -1, 1], atol=1e-15)


@pytest.mark.parametrize(
    "wrong",
    [np.zeros(7), np.zeros((2, 9)), np.zeros((1, 1, 8)), [0, 0, 0, 0, 0, 0, 0, np.nan], "eight"],
)
def test_wrong_angles_are_refused(wrong: object) -> None:
    for function in (forward, forward_as_printed, jacobian):
        with pytest.raises(InputError, match="angles must"):
            function(ROBOT, wrong)


def differing(q: list[float]) -> set[int]:
    """Return the equations (3 to 11) in which printed and corrected kinematics differ."""
    apart = np.abs(forward_as_printed(ROBOT, q) - forward(ROBOT, q)) > 1e-9
    return {int(index) + 3 for index in np.flatnonzero(apart)}


@pytest.mark.parametrize(
    ("name", "pose", "equations"),
    [
        # At 45° the head hides the misprint of Eq. 11, as cos = sin; that of Eq. 8 always shows.
        ("Eq. 8: −L01", [0, 0, 0, 0, 0, 0, 0, np.pi / 4], {8}),
        ("Eq. 11: cos H for sin H", [0, 0, 0, 0, 0, 0, 0, 0.3], {8, 11}),
        ("Eq. 3: sign of cos W sin RS sin RE", [0, 1, 1, 0, 0, 0, 0, np.pi / 4], {3, 8}),
        ("Eq. 4: sign of sin W sin RS sin RE", [HALF_PI, 1, 1, 0, 0, 0, 0, np.pi / 4], {4, 8}),
        ("Eq. 6: sign of cos W sin LS sin LE", [0, 0, 0, 0, 1, -1, 0, np.pi / 4], {6, 8}),
        ("Eq. 7: sign of sin W sin LS sin LE", [HALF_PI, 0, 0, 0, 1, -1, 0, np.pi / 4], {7, 8}),
    ],
)
def test_each_misprint_shows(name: str, pose: list[float], equations: set[int]) -> None:
    assert differing(pose) == equations, name


def test_misprint_of_eqs_4_and_7_in_the_last_term() -> None:
    """With F = 90° the outer cosine vanishes, which leaves cos W in place of sin S."""
    q = [0.5, 0.4, 0.2, HALF_PI, 0.4, -0.2, -HALF_PI, np.pi / 4]
    off = forward_as_printed(ROBOT, q) - forward(ROBOT, q)
    expected = SIZE.L34 * np.sin(0.5) * np.cos(0.2) * (np.cos(0.5) - np.sin(0.4))
    assert_allclose(off[1], expected, atol=1e-12)
    assert_allclose(off[4], expected, atol=1e-12)


def test_printed_left_hand_is_below_the_floor_and_the_last_link_stretches() -> None:
    q = random_poses(2000)
    printed, real = forward_as_printed(ROBOT, q), forward(ROBOT, q)
    # Eq. 8 is too low by L01 twice: it is not added, and it is subtracted.
    assert_allclose(printed[:, 5] - real[:, 5], -2 * SIZE.L01, atol=1e-12)
    # The vector from the right fingertip joint to the hand scales with L34.
    longer = ROBOT.model_copy(update={"lengths": SIZE.model_copy(update={"L34": 2 * SIZE.L34})})
    elbow = 2 * real[:, :3] - forward(longer, q)[:, :3]
    stretched = np.linalg.norm(printed[:, :3] - elbow, axis=1) / SIZE.L34
    assert stretched.max() > 1.25
    assert_allclose(np.linalg.norm(real[:, :3] - elbow, axis=1), SIZE.L34)
