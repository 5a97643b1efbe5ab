"""Forward kinematics against three independent truths, and each misprint of the paper."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from miburi.errors import InputError
from miburi.robot import EXTREMITIES, JOINTS, forward, forward_as_printed, iphonoid, jacobian
from miburi.robot.mjcf import to_mjcf
from miburi.robot.physics import mujoco

ROBOT = iphonoid()
SIZE = ROBOT.lengths
HALF_PI = np.pi / 2

poses = st.tuples(
    *[st.floats(low, high) for low, high in zip(ROBOT.lower, ROBOT.upper, strict=True)]
).map(np.array)


def random_poses(count: int) -> np.ndarray:
    return np.random.default_rng(3).uniform(ROBOT.lower, ROBOT.upper, (count, 8))


def chain(*rows: tuple[float, float, float, float]) -> np.ndarray:
    """Multiply classic Denavit–Hartenberg matrices (θ, d, a, α) and return where they end."""
    product = np.eye(4)
    for theta, d, a, alpha in rows:
        ct, sint, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
        product = product @ np.array(
            [
                [ct, -sint * ca, sint * sa, a * ct],
                [sint, ct * ca, -ct * sa, a * sint],
                [0, sa, ca, d],
                [0, 0, 0, 1],
            ]
        )
    return product[:3, 3]


@given(poses)
def test_forward_equals_the_denavit_hartenberg_product(q: np.ndarray) -> None:
    w, rs, re, rf, ls, le, lf, h = q
    right = chain(
        (w, SIZE.L01, 0, HALF_PI),
        (rs + HALF_PI, SIZE.L12, 0, HALF_PI),
        (re + HALF_PI, 0, SIZE.L23, 0),
        (rf, 0, SIZE.L34, 0),
    )
    left = chain(
        (w, SIZE.L01, 0, -HALF_PI),
        (HALF_PI - ls, SIZE.L12, 0, HALF_PI),
        (le + HALF_PI, 0, SIZE.L23, 0),
        (lf, 0, SIZE.L34, 0),
    )
    head = chain((w, SIZE.L01 + SIZE.LH1, 0, HALF_PI), (h, 0, SIZE.LH2, 0))
    assert_allclose(forward(ROBOT, q), np.concatenate([right, left, head]), atol=1e-14)


def test_forward_equals_mujoco() -> None:
    model = mujoco.MjModel.from_xml_string(to_mjcf(ROBOT))
    data = mujoco.MjData(model)
    places = [model.joint(name).qposadr[0] for name in JOINTS]
    for q in random_poses(200):
        data.qpos[places] = q
        mujoco.mj_kinematics(model, data)
        found = np.concatenate([data.site(name).xpos for name in EXTREMITIES])
        assert_allclose(forward(ROBOT, q), found, atol=1e-9)


@given(poses)
def test_jacobian_equals_numerical_derivatives(q: np.ndarray) -> None:
    step = 1e-6
    shifts = step * np.eye(8)
    numerical = (forward(ROBOT, q + shifts) - forward(ROBOT, q - shifts)).T / (2 * step)
    assert_allclose(jacobian(ROBOT, q), numerical, atol=1e-9)


def test_a_batch_is_the_same_as_one_by_one() -> None:
    batch = random_poses(50)
    together = forward(ROBOT, batch)
    assert together.shape == (50, 9)
    np.testing.assert_array_equal(together, [forward(ROBOT, q) for q in batch])
    assert forward(ROBOT, np.empty((0, 8))).shape == (0, 9)


def test_poses_of_the_body_in_words() -> None:
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
    """Equations (3 to 11) in which printed and corrected kinematics differ."""
    apart = np.abs(forward_as_printed(ROBOT, q) - forward(ROBOT, q)) > 1e-9
    return {int(index) + 3 for index in np.flatnonzero(apart)}


@pytest.mark.parametrize(
    ("name", "pose", "equations"),
    [
        # A head at 45° hides Eq. 11's misprint, as cos = sin there; Eq. 8's L01 never hides.
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
    """With F = 90° the outer cosine is gone: what differs is cos W where sin S belongs."""
    q = [0.5, 0.4, 0.2, HALF_PI, 0.4, -0.2, -HALF_PI, np.pi / 4]
    off = forward_as_printed(ROBOT, q) - forward(ROBOT, q)
    expected = SIZE.L34 * np.sin(0.5) * np.cos(0.2) * (np.cos(0.5) - np.sin(0.4))
    assert_allclose(off[1], expected, atol=1e-12)
    assert_allclose(off[4], expected, atol=1e-12)


def test_printed_left_hand_is_below_the_floor_and_the_last_link_stretches() -> None:
    printed = forward_as_printed(ROBOT, random_poses(2000))
    real = forward(ROBOT, random_poses(2000))
    # Eq. 8 takes L01 away twice: once missing, once subtracted.
    assert_allclose(printed[:, 5] - real[:, 5], -2 * SIZE.L01, atol=1e-12)
    q = random_poses(2000)
    elbow = real[:, :3] - last_link(q)
    stretched = np.linalg.norm(printed[:, :3] - elbow, axis=1) / SIZE.L34
    assert stretched.max() > 1.25
    assert_allclose(np.linalg.norm(real[:, :3] - elbow, axis=1), SIZE.L34)


def last_link(q: np.ndarray) -> np.ndarray:
    """From the right fingertip joint to the hand: the part of the hand that scales with L34."""
    longer = ROBOT.model_copy(update={"lengths": SIZE.model_copy(update={"L34": 2 * SIZE.L34})})
    return (forward(longer, q) - forward(ROBOT, q))[:, :3]
