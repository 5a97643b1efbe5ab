import numpy as np
import pytest

from miburi.errors import InputError
from miburi.studies.gestures.measures import measure

TIME = np.linspace(0, 1, 1001)


def motion(right, left=None):
    """A recorded motion (n, 9) of the given hands (n, 3); the head stands still."""
    still = np.zeros_like(right)
    return np.hstack([right, still if left is None else left, still])


def test_there_and_back_on_a_line_is_direct():
    there_and_back = np.abs(1 - 2 * TIME)[:, None] * [0.2, 0, 0]
    measures = measure(motion(there_and_back, there_and_back + 1), 1e-3)
    assert measures.duration == pytest.approx(1.0)
    assert measures.path == pytest.approx(0.8)
    assert measures.mean_speed == pytest.approx(0.4)
    assert measures.directness == pytest.approx(1.0)
    assert measures.curvature == pytest.approx(0.0, abs=1e-6)


def test_a_circle_has_its_radius_for_curvature():
    angle = 2 * np.pi * TIME
    circle = 0.1 * np.column_stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)])
    measures = measure(motion(circle), 1e-3)
    speed = 0.1 * 2 * np.pi
    assert measures.curvature == pytest.approx(10.0, rel=1e-3)
    assert measures.mean_speed == pytest.approx(speed / 2, rel=1e-3)  # the other hand rests
    assert measures.mean_acceleration == pytest.approx(speed**2 / 0.1 / 2, rel=1e-3)
    assert measures.mean_jerk == pytest.approx(speed**3 / 0.1**2 / 2, rel=1e-3)
    assert measures.directness == pytest.approx(2 * 0.2 / (2 * np.pi * 0.1), rel=1e-3)


CUBE = np.stack(np.meshgrid(*3 * [np.linspace(0, 1, 6)]), axis=-1).reshape(-1, 3)
OCTAHEDRON = np.tile(np.vstack([np.eye(3), -np.eye(3)]), (4, 1))


@pytest.mark.parametrize(
    ("points", "volume"),
    [
        (CUBE, 1.0), (0.01 * CUBE + 5, 1e-6), (0.1 * OCTAHEDRON, 4e-3 / 3),
        (np.ones((18, 3)), 0), (np.outer(np.arange(18.0), [1, 2, 3]), 0),
        (CUBE * [0.3, 0, 0.2] + 0.1, 0),
    ],
    ids=["cube", "small cube far away", "octahedron", "one place", "line", "plane"],
)  # fmt: skip
def test_the_volume_is_that_of_hands_and_head_together(points, volume):
    assert measure(np.reshape(points, (-1, 9)), 0.1).volume == pytest.approx(volume, rel=1e-9)


def test_who_does_not_move_shows_nothing():
    measures = measure(np.tile(np.arange(9.0), (10, 1)), 0.02)
    assert measures.path == measures.mean_speed == measures.mean_jerk == 0
    assert measures.directness == measures.curvature == 0


@pytest.mark.parametrize(
    ("positions", "period"),
    [
        (np.zeros((4, 9)), 0.1),
        (np.zeros((9, 8)), 0.1),
        (np.full((9, 9), np.nan), 0.1),
        (np.zeros((9, 9)), 0.0),
        (np.zeros((9, 9)), float("nan")),
    ],
)
def test_what_is_no_motion_is_refused(positions, period):
    with pytest.raises(InputError):
        measure(positions, period)
