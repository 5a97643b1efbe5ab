"""The optimiser alone on standard test functions, beside cma, SciPy and pymoo.

The budget is in evaluations, 500 a dimension, the same for everybody. Each value is the median over
seeds of the best found, the optimum being 0. Each seed puts the optimum elsewhere in the box (not
Schwefel's, whose value falls without end outside of its own), so that nobody gains by starting in
the middle, as Miburi does. A rotated function is the same one along the axes of
a random orthogonal matrix. ``python bench/ik/functions.py`` writes ``functions.md``.
"""

from contextlib import suppress
from dataclasses import replace
from functools import cache
from multiprocessing import Pool
from pathlib import Path

import cma
import numba
import numpy as np
from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.core.problem import Problem
from pymoo.optimize import minimize as pymoo_minimize
from scipy.optimize import differential_evolution, dual_annealing

from miburi import bma

HERE = Path(__file__).parent
SEEDS = 10
PER_DIMENSION = 500


@numba.njit
def sphere(x):
    return np.sum(x**2)


@numba.njit
def ellipsoid(x):
    return np.sum(10.0 ** (6.0 * np.arange(len(x)) / (len(x) - 1)) * x**2)


@numba.njit
def rosenbrock(x):
    return np.sum(100 * (x[1:] - x[:-1] ** 2) ** 2 + (1 - x[:-1]) ** 2)


@numba.njit
def rastrigin(x):
    return 10 * len(x) + np.sum(x**2 - 10 * np.cos(2 * np.pi * x))


@numba.njit
def ackley(x):
    spread = np.exp(-0.2 * np.sqrt(np.mean(x**2)))
    return 20 + np.e - 20 * spread - np.exp(np.mean(np.cos(2 * np.pi * x)))


@numba.njit
def griewank(x):
    return 1 + np.sum(x**2) / 4000 - np.prod(np.cos(x / np.sqrt(np.arange(1, len(x) + 1))))


@numba.njit
def schwefel(x):
    return 418.9828872724339 * len(x) - np.sum(x * np.sin(np.sqrt(np.abs(x))))


@cache
def axes(dimensions):
    """Return a random orthogonal matrix, (n, n)."""
    drawn = np.random.default_rng(dimensions).normal(size=(dimensions, dimensions))
    return np.linalg.qr(drawn)[0]


def rotated(function, centre=0.0):
    """Return the function along other axes, turned about its optimum."""

    def turned(x):
        return function(axes(len(x)) @ (x - centre) + centre)

    turned.__name__ = f"{function.__name__}, rotated"
    return turned


def moved(function, bound, dimensions, seed):
    """Return the function with its optimum at a place drawn from the inner 80 % of the box."""
    if function is schwefel:
        return function
    low, high = bound
    edge = 0.1 * (high - low)
    place = np.random.default_rng([seed, dimensions]).uniform(low + edge, high - edge, dimensions)
    optimum = 1.0 if function.__name__.startswith("rosenbrock") else 0.0
    return lambda x: function(x - place + optimum)


FUNCTIONS = {
    sphere: (-4.0, 6.0),
    ellipsoid: (-4.0, 6.0),
    rotated(ellipsoid): (-4.0, 6.0),
    rosenbrock: (-2.0, 3.0),
    rotated(rosenbrock, 1.0): (-2.0, 3.0),
    rastrigin: (-4.5, 5.5),
    rotated(rastrigin): (-4.5, 5.5),
    ackley: (-25.0, 35.0),
    griewank: (-500.0, 700.0),
    schwefel: (-500.0, 500.0),
}

#: Sums of functions of one variable each: a search of one variable after the other solves them.
SEPARABLE = (sphere, ellipsoid, rastrigin, schwefel)


class Counted:
    """A function that counts, keeps its best value, and stops whoever spends too much."""

    class SpentError(Exception):
        """The budget is spent."""

    def __init__(self, function, budget):
        self.function, self.left, self.best = function, budget, np.inf

    def __call__(self, x):
        if self.left <= 0:
            raise self.SpentError
        self.left -= 1
        value = float(self.function(np.asarray(x)))
        self.best = min(self.best, value)
        return value


def with_bma(settings):
    def run(f, bounds, seed):
        bma.minimize(f, bounds, seed=seed, settings=settings)

    return run


def with_cma(f, bounds, seed):
    low, high = np.array(bounds).T
    start = np.random.default_rng(seed).uniform(low, high)
    options = {"bounds": [low.tolist(), high.tolist()], "verbose": -9, "seed": seed + 1}
    cma.fmin2(f, start, 0.25 * (high[0] - low[0]), options, restarts=9, bipop=True)


def with_scipy(f, bounds, seed):
    differential_evolution(f, bounds, rng=seed, maxiter=10**6, tol=0, polish=False)


def with_polish(f, bounds, seed):
    """A small population for four fifths of the budget; the rest is for L-BFGS-B, from its best."""
    generations = f.left * 4 // 5 // (5 * len(bounds)) - 1
    differential_evolution(f, bounds, rng=seed, popsize=5, maxiter=generations, tol=0, polish=True)


def with_annealing(f, bounds, seed):
    dual_annealing(f, bounds, rng=seed, maxiter=10**6, maxfun=10**9)


def with_pymoo(f, bounds, seed):
    low, high = np.array(bounds).T

    class Single(Problem):
        def __init__(self):
            super().__init__(n_var=len(low), n_obj=1, xl=low, xu=high)

        def _evaluate(self, x, out, *_, **__):
            out["F"] = np.array([f(row) for row in x])

    pymoo_minimize(Single(), GA(pop_size=100), ("n_eval", 10**9), seed=seed + 1)


ENDLESS = replace(bma.Settings(), generations=10**6, target=-np.inf, patience=0)
SOLVERS = {
    "Miburi, default": with_bma(ENDLESS),
    "Miburi, as printed": with_bma(replace(bma.Settings.paper(), generations=10**6)),
    "cma (BIPOP)": with_cma,
    "scipy DE": with_scipy,
    "scipy DE, polished": with_polish,
    "scipy dual_annealing": with_annealing,
    "pymoo GA": with_pymoo,
}


def row(index, dimensions):
    """Return the table's line for one function in one number of dimensions."""
    function, bound = list(FUNCTIONS.items())[index]
    medians = []
    for run in SOLVERS.values():
        best = []
        for seed in range(SEEDS):
            counted = Counted(moved(function, bound, dimensions, seed), PER_DIMENSION * dimensions)
            with suppress(Counted.SpentError):
                run(counted, [bound] * dimensions, seed)
            best.append(max(counted.best, 0.0))
        medians.append(float(np.median(best)))
    least = max(min(medians), 1e-8)
    cells = [f"**{m:.1e}**" if m <= least else f"{m:.1e}" for m in medians]
    apart = "yes" if function in SEPARABLE else "no"
    return f"| {function.__name__} | {apart} | {dimensions} | " + " | ".join(cells) + " |"


def main():
    lines = [
        f"Median best value over {SEEDS} seeds, {PER_DIMENSION} evaluations per dimension; "
        "bold: least, or below 1e-8.",
        "",
        "| function | separable | dimensions | " + " | ".join(SOLVERS) + " |",
        "|---|---|---|" + "---|" * len(SOLVERS),
    ]
    rows = [(index, size) for index in range(len(FUNCTIONS)) for size in (8, 20)]
    with Pool() as pool:
        for line in pool.starmap(row, rows, chunksize=1):
            print(line)
            lines.append(line)
    (HERE / "functions.md").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
