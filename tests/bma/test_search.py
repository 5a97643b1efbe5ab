import dataclasses

import numpy as np
import pytest
import scipy.optimize

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
    def test_the_same_seed_gives_the_same_result_and_another_seed_another(self):
        settings = bma.Settings(generations=2, target=-np.inf, first_iterations=0)

        def waves(x):
            return sphere(x) + float(np.sum(np.cos(40 * x)))

        a, b, c = (bma.minimize(waves, BOX, settings=settings, seed=s) for s in (1, 1, 2))
        assert a.x.tobytes() == b.x.tobytes()
        assert a.x.tobytes() != c.x.tobytes()

    def test_nan_is_refused_with_the_point_named(self):
        with pytest.raises(InputError, match=r"NaN at x = \[0\.5, 0\.5, 0\.5, 0\.5\]"):
            bma.minimize(lambda x: np.nan, BOX)

    def test_ends_at_the_deadline_with_the_best_so_far(self):
        result = bma.minimize(sphere, BOX, settings=bma.Settings.paper(), deadline=1e-9)
        assert result.status == bma.DEADLINE
        assert result.evaluations < 100
        assert np.isfinite(result.value)

    def test_settles_where_nothing_better_is_left(self):
        settings = bma.Settings(patience=2, target=-np.inf)
        result = bma.minimize(lambda x: 1.0 + sphere(x), BOX, settings=settings)
        assert result.status == bma.SETTLED
        assert result.value == pytest.approx(1)
        assert result.generations < 35

    def test_a_callback_sees_every_generation_and_may_end_the_search(self):
        seen = []

        def third(result):
            seen.append(result.generations)
            return len(seen) == 3

        result = bma.minimize(sphere, BOX, settings=bma.Settings.paper(), callback=third)
        assert seen == [1, 2, 3]
        assert result.status == bma.STOPPED

    def test_segments_of_several_variables_and_an_odd_dimension(self):
        settings = bma.Settings(segment=3, transferred=2, individuals=5, first_iterations=0)
        result = bma.minimize(
            lambda x: float(np.sum((x - 0.1) ** 2)), [(-1, 1)] * 7, settings=settings
        )
        assert result.value <= 1e-9

    def test_leaves_a_local_minimum_at_an_end_of_the_range(self):
        """The start descends to the near end; the global minimum is entered from the far one."""
        settings = bma.Settings(
            local_search="residual",
            damping=1e-4,
            gradient_tolerance=1e-12,
            first_iterations=30,
            generations=0,
            target=1e-12,
        )

        def trap(x):
            return np.array([(x[0] + 1) * np.tanh(3 * (9.9 - x[0]))])

        bounds = [(0, 10)]
        without = bma.minimize(trap, bounds, settings=settings)
        assert without.value > 1e-3
        with_ends = bma.minimize(trap, bounds, settings=dataclasses.replace(settings, ends=1))
        assert with_ends.value <= 1e-12
        assert with_ends.x[0] == pytest.approx(9.9)


class TestKnownOptima:
    """Standard test functions; the best values are known to be 0."""

    @pytest.mark.parametrize(
        ("function", "bound", "reached"),
        [
            (lambda x: np.sum(x**2), 5.0, 1e-10),
            (lambda x: np.sum(10 + x**2 - 10 * np.cos(2 * np.pi * x)), 5.12, 1e-6),
            (lambda x: np.sum(418.9828872724339 - x * np.sin(np.sqrt(np.abs(x)))), 500.0, 1e-3),
        ],
        ids=["sphere", "rastrigin", "schwefel"],
    )
    def test_are_found(self, function, bound, reached):
        settings = bma.Settings(target=reached, first_iterations=0)
        bounds = [(-bound, bound * 1.1)] * 6
        for seed in range(2):
            result = bma.minimize(
                lambda x: float(function(x)), bounds, settings=settings, seed=seed
            )
            assert result.status == bma.CONVERGED, (seed, result)


class TestUnits:
    """The result does not depend on the unit of a variable or of the value."""

    @pytest.mark.parametrize(("value", "size"), [(1e-6, 1e6), (1e6, 1e-6)])
    def test_a_sphere_is_found_in_any(self, value, size):
        box = [(-4.0 * size, 6.0 * size)] * 3
        settings = bma.Settings(generations=1)
        result = bma.minimize(lambda x: value * float(np.sum(x**2)), box, settings=settings)
        assert result.value <= 1e-12
        same = bma.minimize(lambda x: float(np.sum(x**2)), [(-4.0, 6.0)] * 3, settings=settings)
        assert result.evaluations == pytest.approx(same.evaluations, rel=0.1)

    @pytest.mark.parametrize("unit", [1e-6, 1e6])
    def test_rosenbrock_takes_as_many_steps_in_any(self, unit):
        box = [(-2.0 * unit, 3.0 * unit)] * 2
        found = bma.minimize(
            lambda x: unit * rosenbrock_residuals(x / unit), box,
            settings=bma.Settings(local_search="residual"),
        )  # fmt: skip
        assert found.status == bma.CONVERGED
        assert found.evaluations <= 200
        assert np.allclose(found.x, unit, rtol=1e-6)


class TestFewEvaluations:
    @pytest.mark.parametrize("offset", [0.0, 3.0])
    @pytest.mark.parametrize("unit", [1e-6, 1e6])
    def test_linear_residuals_are_known_to_be_done(self, offset, unit):
        """Also where none of them comes to 0, so that no value says that the search is over."""
        generator = np.random.default_rng(0)
        matrix, beside = generator.normal(size=(6, 3)), offset * generator.normal(size=6)
        wanted = matrix @ [0.3, -0.2, 0.7] + beside
        found = bma.minimize(
            lambda x: unit * (matrix @ x - wanted), [(-9.0, 8.0)] * 3,
            settings=bma.Settings(local_search="residual"),
        )  # fmt: skip
        assert found.status == bma.CONVERGED
        assert found.evaluations <= 100
        assert np.allclose(found.x, np.linalg.lstsq(matrix, wanted, rcond=None)[0], atol=1e-6)

    @pytest.mark.parametrize("start", [None, (2.0, -2.0)])
    def test_rosenbrock_by_gradients(self, start):
        values = []

        def rosenbrock(x):
            values.append(float(np.sum(rosenbrock_residuals(x) ** 2)))
            return values[-1]

        bma.minimize(rosenbrock, [(-2.0, 3.0)] * 2, start=start)
        assert min(values[:2000]) <= 1e-6

    def test_given_derivatives_take_the_place_of_evaluations(self):
        def jacobian(x):
            return [[-1.0, 0.0], [-20.0 * x[0], 10.0]]

        settings = bma.Settings(local_search="residual")
        box = [(-2.0, 3.0)] * 2
        found = bma.minimize(rosenbrock_residuals, box, settings=settings, jacobian=jacobian)
        alone = bma.minimize(rosenbrock_residuals, box, settings=settings)
        assert found.evaluations < 0.5 * alone.evaluations
        assert np.allclose(found.x, 1.0)


class TestOptimizer:
    def test_refuses_the_wrong_number_of_values_and_asking_after_the_end(self):
        search = bma.Optimizer(BOX)
        search.ask()
        with pytest.raises(InputError, match="one for each point"):
            search.tell([1.0, 2.0])
        search.stop(bma.DEADLINE)
        with pytest.raises(InputError, match="has ended"):
            search.ask()

    def test_refuses_one_number_where_residuals_are_needed(self):
        with pytest.raises(InputError, match="residuals"):
            bma.minimize(sphere, BOX, settings=RESIDUAL)


class TestScipyMethod:
    @pytest.mark.parametrize(
        "bounds", [[(-2, 3)] * 2, scipy.optimize.Bounds([-2, -2], [3, 3])], ids=["pairs", "Bounds"]
    )
    def test_serves_scipy(self, bounds):
        result = scipy.optimize.minimize(
            lambda x, shift: np.sum((x - shift) ** 2),
            [0, 0],
            args=(0.7,),
            method=bma.scipy_method,
            bounds=bounds,
            options={"seed": 4},
        )
        assert result.success
        assert np.allclose(result.x, 0.7, atol=1e-5)
        assert result.nfev > 0

    def test_takes_scipys_own_options_and_derivatives(self):
        def call(**more):
            return scipy.optimize.minimize(
                lambda x: float(np.sum((x - 0.7) ** 2)), [0.0, 0.0], method=bma.scipy_method,
                bounds=[(-2, 3)] * 2, **more,
            )  # fmt: skip

        assert call(options={"maxiter": 2}).nit == 2
        assert call(options={"maxiter": 2}).status == 1
        coarse = call(tol=0.5, options={"maxiter": 0})
        assert coarse.nfev < call(options={"maxiter": 0}).nfev
        with_slopes = call(jac=lambda x: 2.0 * (x - 0.7))
        assert with_slopes.nfev < call().nfev
        assert np.allclose(with_slopes.x, 0.7)


class TestSettings:
    @pytest.mark.parametrize(
        ("name", "value"),
        [
            ("individuals", 1),
            ("generations", 1.5),
            ("local_probability", np.nan),
            ("damping", 0.0),
            ("target", np.nan),
            ("local_search", "newton"),
            ("patience", True),
            ("clones", 10**9),
            ("target", 10**400),
            ("relative", 1),
        ],
    )
    def test_refuse_what_is_not_allowed_and_say_what_is(self, name, value):
        with pytest.raises(InputError, match=name):
            bma.Settings(**{name: value})


@pytest.mark.parametrize("seed", [-1, 1.5, True, None, 1 << 63])
def test_a_seed_that_is_none_is_refused(seed):
    with pytest.raises(InputError, match="seed"):
        bma.minimize(sphere, BOX, seed=seed)


def test_a_generator_serves_as_a_seed():
    a, b = (
        bma.minimize(
            sphere, BOX, seed=np.random.default_rng(6), settings=bma.Settings(generations=1)
        )
        for _ in range(2)
    )
    assert a.x.tobytes() == b.x.tobytes()
