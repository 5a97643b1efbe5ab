"""What functions, bounds and callers may do to the optimiser without breaking it."""

import numpy as np
import pytest
import scipy.optimize
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from miburi import bma
from miburi.errors import InputError

BOX = [(-2.0, 2.0)] * 3
QUICK = bma.Settings(generations=2, individuals=4, clones=3, transfers=2, local_probability=0.5)
QUICK_RESIDUAL = bma.Settings(
    generations=2, individuals=4, clones=3, local_search="residual", ends=2, damping=1e-3
)


def inside(x, box=BOX):
    low, high = np.array(box).T
    assert np.all((x >= low) & (x <= high)), x  # NaN fails it too
    return x


class TestInfinity:
    @pytest.mark.parametrize("seed", range(2))
    def test_with_the_minimum_at_the_edge_of_what_is_allowed(self, seed):
        def function(x):
            inside(x)
            return np.inf if x[0] + x[1] < 1 else float(np.sum(x**2))

        result = bma.minimize(function, BOX, seed=seed)
        assert 0.5 <= result.value <= 0.505

    @pytest.mark.parametrize("seed", range(2))
    def test_where_it_begins(self, seed):
        def function(x):
            inside(x)
            return np.inf if np.all(np.abs(x) < 0.5) else float(np.sum((x - 1) ** 2))

        assert bma.minimize(function, BOX, seed=seed).value <= 1e-9

    @pytest.mark.parametrize("bad", [np.inf, -np.inf])
    def test_among_residuals(self, bad):
        def residuals(x):
            inside(x)
            return np.full(2, bad) if x[0] < 0.3 else np.array([x[0] - 0.2, x[1] - 1])

        result = bma.minimize(residuals, BOX, settings=bma.Settings(local_search="residual"))
        assert result.x[0] >= 0.3
        assert result.value == pytest.approx(0.01, abs=1e-4)

    @pytest.mark.parametrize("settings", [QUICK, QUICK_RESIDUAL], ids=["gradient", "residual"])
    def test_everywhere_is_said_and_is_no_success(self, settings):
        result = bma.minimize(
            lambda x: np.full(2, np.inf) * inside(x)[0] ** 0, BOX, settings=settings
        )
        assert (result.value, result.status) == (np.inf, bma.NOTHING_ALLOWED)
        inside(result.x)
        found = scipy.optimize.minimize(
            lambda x: np.inf, np.zeros(3), method=bma.scipy_method, bounds=BOX,
            options={"settings": QUICK},
        )  # fmt: skip
        assert (found.success, found.status, found.message) == (False, 2, bma.NOTHING_ALLOWED)

    def test_below_zero_is_the_least_value_there_is(self):
        result = bma.minimize(lambda x: -np.inf if x[0] > 1.9 else x[0], BOX)
        assert result.status == bma.CONVERGED
        assert result.value == -np.inf


class TestValues:
    def test_below_zero_do_not_end_the_search(self):
        result = bma.minimize(lambda x: x[0], BOX)
        assert result.value == -2.0
        assert result.status == bma.SETTLED
        assert scipy.optimize.minimize(
            lambda x: x[0], np.zeros(3), method=bma.scipy_method, bounds=BOX
        ).fun == pytest.approx(-2.0)

    @pytest.mark.parametrize(
        "value",
        ["text", None, 1j, np.zeros((2, 2)), [], [1.0, [2.0]], np.ma.masked_all(2), np.nan],
        ids=str,
    )
    @pytest.mark.parametrize("settings", [QUICK, QUICK_RESIDUAL], ids=["gradient", "residual"])
    def test_that_are_none_are_refused(self, value, settings):
        with pytest.raises(InputError):
            bma.minimize(lambda x: value, BOX, settings=settings)

    def test_that_change_their_shape_are_refused(self):
        with pytest.raises(InputError, match=r"shape|one length"):
            bma.minimize(lambda x: np.ones(2 if x[0] > 0.1 else 3), BOX, settings=QUICK_RESIDUAL)

    @pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, ZeroDivisionError])
    def test_what_the_function_raises_goes_through(self, error):
        def function(x):
            raise error("mine")

        with pytest.raises(error, match="mine"):
            bma.minimize(function, BOX)

    def test_the_functions_own_stop_iteration_does_not_pass_for_the_end_of_a_loop(self):
        def function(x):
            return next(iter(()))

        with pytest.raises(RuntimeError, match="StopIteration"):
            bma.minimize(function, BOX)

    def test_a_callback_may_end_the_search_as_scipy_says(self):
        def callback(_):
            raise StopIteration

        result = bma.minimize(lambda x: x[0], BOX, callback=callback)
        assert result.status == bma.STOPPED
        found = scipy.optimize.minimize(
            lambda x: x[0], np.zeros(3), method=bma.scipy_method, bounds=BOX, callback=callback
        )
        assert found.message == bma.STOPPED


@given(
    dimensions=st.sampled_from([1, 2, 7, 40]),
    seed=st.integers(0, 2**63 - 1),
    values=st.lists(st.floats(allow_nan=False, width=64), min_size=1, max_size=6),
    local_search=st.sampled_from(["gradient", "residual", "printed"]),
)
@hypothesis_settings(max_examples=40, deadline=None)
def test_whatever_the_values_the_box_is_kept(dimensions, seed, values, local_search):
    """The function makes no sense: it returns given numbers in turn, infinite ones among them."""
    box = [(-1.0, 3.0)] * dimensions
    calls = iter(range(10**9))

    def function(x):
        inside(x, box)
        value = values[next(calls) % len(values)]
        return np.array([value, x[0]]) if local_search == "residual" else value

    settings = bma.Settings(
        generations=1, individuals=2, clones=2, transfers=1, local_search=local_search,
        local_probability=1.0, local_iterations=2, first_iterations=2,
    )  # fmt: skip
    with np.errstate(over="ignore", invalid="ignore"):
        result = bma.minimize(function, box, settings=settings, seed=seed)
    inside(result.x, box)
    assert not np.isnan(result.value)


@given(low=st.floats(), high=st.floats())
@hypothesis_settings(max_examples=40, deadline=None)
def test_bounds_are_a_box_or_refused(low, high):
    def function(x):
        assert low <= x[0] <= high
        return float(x[0] > 0)

    width = high - low
    if np.isfinite(low) and np.isfinite(high) and low <= high and np.isfinite(width):
        result = bma.minimize(function, [(low, high)], settings=QUICK)
        assert low <= result.x[0] <= high
    else:
        with pytest.raises(InputError, match="bounds"):
            bma.minimize(function, [(low, high)])


@pytest.mark.parametrize("dimensions", [1, 100])
def test_one_variable_and_a_hundred(dimensions):
    result = bma.minimize(
        lambda x: float(np.sum((x - 0.3) ** 2)), [(-1.0, 2.0)] * dimensions, settings=QUICK
    )
    assert result.value <= 1e-9


@pytest.mark.parametrize(
    "bad", [{"bounds": [(0, 1j)]}, {"bounds": BOX, "start": "here"}, {"bounds": BOX, "start": [0]},
            {"bounds": BOX, "start": [0, 1j, 0]}, {"bounds": BOX, "start": [0, 9, 0]},
            {"bounds": BOX, "deadline": "soon"}, {"bounds": BOX, "deadline": 0},
            {"bounds": [("0", "1")]}, {"bounds": [(0, 10**400)]},
            {"bounds": []}, {"bounds": [0, 1]},
            {"bounds": BOX, "settings": "paper"},
            {"bounds": BOX, "jacobian": lambda x: np.zeros(2)}],
    ids=lambda bad: str(bad)[:40],
)  # fmt: skip
def test_arguments_that_make_no_sense_are_refused(bad):
    with pytest.raises(InputError):
        bma.minimize(lambda x: x[0], **bad)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"bounds": BOX, "options": {"popsize": 3}}, "maxiter and tol, got popsize"),
        ({}, "searches a box; pass bounds"),
    ],
)
def test_options_that_the_search_cannot_use_are_refused(given, words):
    with pytest.raises(InputError, match=words):
        scipy.optimize.minimize(lambda x: x[0], np.zeros(3), method=bma.scipy_method, **given)


def test_a_fixed_variable_stays_where_it_is():
    def function(x):
        assert x[1] == 0.7
        return float((x[0] - 0.3) ** 2 + x[1])

    for settings in (QUICK, bma.Settings.paper()):
        result = bma.minimize(function, [(-1, 1), (0.7, 0.7)], settings=settings)
        assert result.x == pytest.approx([0.3, 0.7], abs=1e-3)
    residuals = bma.minimize(lambda x: x - 0.5, [(0, 1), (0.7, 0.7)], settings=QUICK_RESIDUAL)
    assert residuals.x == pytest.approx([0.5, 0.7])


class TestAskAndTell:
    def test_values_are_told_once_for_points_asked_for(self):
        search = bma.Optimizer(BOX, settings=QUICK)
        with pytest.raises(InputError, match="ask"):
            search.tell([1.0])
        values = [x[0] for x in search.ask()]
        search.tell(values)
        with pytest.raises(InputError, match="ask"):
            search.tell(values)

    def test_wrong_values_change_nothing(self):
        search = bma.Optimizer(BOX, settings=QUICK)
        points = search.ask()
        for wrong in ([1.0, 2.0], [np.nan], ["text"], [1j]):
            with pytest.raises(InputError):
                search.tell(wrong)
        assert np.array_equal(search.ask(), points)
        search.tell([1.0])
        assert search.result.evaluations == 1
