import numpy as np
import pytest

from miburi import bma
from miburi.errors import InputError

BOX = [(-2.0, 3.0)] * 4


def sphere(x):
    return float(np.sum((x - 0.4) ** 2))


def rosenbrock_residuals(x):
    return np.concatenate([1 - x[:-1], 10 * (x[1:] - x[:-1] ** 2)])


RESIDUAL = bma.Settings(
    local_search="residual", damping=1e-3, gradient_tolerance=1e-12, first_iterations=30
)


class TestMinimize:
    def test_finds_the_minimum_of_a_plain_function(self):
        result = bma.minimize(sphere, BOX, seed=1)
        assert result.status == bma.CONVERGED
        assert result.value <= 1e-12
        assert np.allclose(result.x, 0.4, atol=1e-6)

    def test_finds_the_minimum_of_a_sum_of_squared_residuals(self):
        result = bma.minimize(rosenbrock_residuals, BOX, settings=RESIDUAL, seed=1)
        assert result.status == bma.CONVERGED
        assert np.allclose(result.x, 1, atol=1e-5)

    def test_the_same_seed_gives_the_same_result_and_another_seed_another(self):
        settings = bma.Settings(generations=2, target=-np.inf, first_iterations=0)
        a, b, c = (bma.minimize(sphere, BOX, settings=settings, seed=s) for s in (1, 1, 2))
        assert a.x.tobytes() == b.x.tobytes()
        assert a.x.tobytes() != c.x.tobytes()

    @pytest.mark.parametrize("settings", [bma.Settings(generations=3), bma.Settings.paper()])
    def test_never_calls_the_function_outside_of_the_box(self, settings):
        low, high = np.array([-0.1, 0.3]), np.array([0.2, 0.3000001])

        def corner(x):
            assert np.all(x >= low)
            assert np.all(x <= high)
            return float(x[0] - x[1] + 1)

        result = bma.minimize(corner, np.column_stack([low, high]), settings=settings)
        assert result.value == pytest.approx(1 - 0.1 - 0.3000001, abs=1e-9)

    def test_nan_is_refused_with_the_point_named(self):
        with pytest.raises(InputError, match=r"NaN at x = \[0\.5, 0\.5, 0\.5, 0\.5\]"):
            bma.minimize(lambda x: np.nan, BOX)


class TestPaper:
    def test_evaluates_as_often_as_table_2_says(self):
        """12 at first; 35 x (12 x 8 x 9 clones + 15 transfers); 17 a local iteration at most."""
        settings = bma.Settings.paper()
        fixed = 12 + 35 * (12 * 8 * 9 + 15)
        result = bma.minimize(
            lambda x: float(np.sum(np.cos(9 * x))), [(0, 1)] * 8, settings=settings
        )
        assert result.generations == 35
        assert result.status == bma.BUDGET_SPENT
        assert fixed < result.evaluations <= fixed + 35 * 12 * 8 * 17
