import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from miburi.hull import hull_volume


def test_a_unit_cube_with_points_inside_on_faces_and_on_edges():
    steps = np.linspace(0, 1, 5)
    grid = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    assert hull_volume(grid) == pytest.approx(1.0)
    assert hull_volume(0.01 * grid + 5) == pytest.approx(1e-6)


@pytest.mark.parametrize("flat", [np.ones((6, 3)), np.eye(3), np.outer(np.arange(9.0), [1, 2, 3])])
def test_what_is_flat_has_no_volume(flat):
    assert hull_volume(flat) == 0.0


@given(st.integers(0, 10_000), st.integers(4, 400), st.booleans())
def test_it_agrees_with_qhull(seed, count, path):
    points = np.random.default_rng(seed).normal(size=(count, 3))
    points = np.cumsum(points, axis=0) if path else points
    hull = ConvexHull(points)
    # Half a grid step all over the surface.
    assert hull_volume(points) == pytest.approx(
        hull.volume, abs=hull.area * np.ptp(points) / 40_000
    )


def test_arcs_traced_there_and_back_like_a_hand_does():
    turn = np.linspace(0, 2, 300)
    arc = np.column_stack([np.cos(turn), np.sin(turn), 1e-7 * np.sin(40 * turn)])
    points = np.vstack([arc, arc[::-1] + 1e-9, [[0, 0, 0.5]]])
    assert hull_volume(points) == pytest.approx(ConvexHull(points).volume, rel=1e-3)
