"""Optimisers that know nothing of robots: SciPy's, cma and pymoo."""

# Matrices have capital letters, and not every peer needs all that a maker is given.
# ruff: noqa: N803, N806, ARG001, ARG002, ARG005

import itertools
import math
import warnings

import numpy as np

from peers.body import HALF, HI, LO, MID, STOP2, errors, jit, square, sum_squares


@jit
def from_sines(u):
    """Pose of unbounded angles: q = MID + HALF sin u never leaves the limits."""
    q = np.empty(8)
    for i in range(8):
        q[i] = MID[i] + HALF[i] * math.sin(u[i])
    return q


@jit
def to_sines(q):
    u = np.empty(8)
    for i in range(8):
        u[i] = math.asin(min(1.0, max(-1.0, (q[i] - MID[i]) / HALF[i])))
    return u


@jit
def res(q, t, stop2):
    """Residual; zeros as soon as it is good enough, which ends any gradient method at once."""
    r = np.empty(9)
    enough = square(q, t, r) < stop2
    for i in range(9):
        r[i] = 0.0 if enough else r[i] - t[i]
    return r


_jac = jit(lambda q, t, stop2: errors(q, t)[1].T)
_sine_res = jit(lambda u, t, stop2: res(from_sines(u), t, stop2))


@jit
def _sine_jac(u, t, stop2):
    """By columns."""
    J = errors(from_sines(u), t)[1]
    for i in range(8):
        c = HALF[i] * math.cos(u[i])
        for k in range(9):
            J[i, k] *= c
    return J


_sine_jac_rows = jit(lambda u, t, stop2: _sine_jac(u, t, stop2).T)


def make_trf(reach):
    """SciPy's least_squares (trf): over sines, so without bounds, in reach; with bounds if far."""
    from scipy.optimize import least_squares

    near_options = {"ftol": 1e-2, "xtol": 1e-5, "x_scale": 0.3, "max_nfev": 30}
    far_options = {"ftol": 1e-5, "xtol": 1e-5, "bounds": (LO, HI), "max_nfev": 200}

    def near(target, start):
        u, args = to_sines(start), (target, STOP2)
        r = least_squares(_sine_res, u, _sine_jac_rows, args=args, **near_options)
        return from_sines(r.x)

    def far(target, start):
        return least_squares(res, start, _jac, args=(target, 0.0), **far_options).x

    return near if reach else far


def make_leastsq(reach):
    """SciPy's leastsq (MINPACK) over sines, which keep the limits; first steps short (factor)."""
    from scipy.optimize import leastsq

    stop2, ftol, xtol, maxfev = (STOP2, 0.1, 1e-4, 30) if reach else (0.0, 1e-6, 1e-6, 200)
    options = {"col_deriv": True, "ftol": ftol, "xtol": xtol, "maxfev": maxfev}
    options |= {"factor": 0.2, "diag": 1.0 / HALF}
    warnings.filterwarnings("ignore", "Number of calls to function")  # out of reach it may be so

    def solve(target, start):
        u, args = to_sines(start), (target, stop2)
        return from_sines(leastsq(_sine_res, u, args, _sine_jac, **options)[0])

    return solve


@jit
def cost(q, t, stop2, scale):
    """Half the squared residual times scale, and its gradient; both zero when good enough."""
    r, J = errors(q, t)
    g = np.zeros(8)
    f = sum_squares(r)
    if f < stop2:
        return 0.0, g
    for i in range(8):
        v = 0.0
        for k in range(9):
            v += J[i, k] * r[k]
        g[i] = scale * v
    return 0.5 * scale * f, g


def make_lbfgsb(reach):
    """SciPy's fmin_l_bfgs_b with the exact gradient, a scaled-up cost and a memory of 20 steps."""
    from scipy.optimize import fmin_l_bfgs_b

    stop2, scale = (STOP2, 200.0) if reach else (0.0, 1e4)
    ftol, gtol, maxiter = (1e-7, 1e-7, 60) if reach else (1e-11, 1e-8, 500)
    bounds = list(zip(LO.tolist(), HI.tolist(), strict=True))
    options = {"m": 20, "factr": ftol / np.finfo(float).eps, "pgtol": gtol, "maxiter": maxiter}

    def solve(target, start):
        return fmin_l_bfgs_b(cost, start, None, (target, stop2, scale), False, bounds, **options)[0]

    return solve


@jit
def _con(q, t):
    """Eight equations for eight joints: the hands' six, the head's turn and its height."""
    r = np.empty(9)
    s = square(q, t, r)
    c = np.zeros(8)
    if s < STOP2:
        return c
    for i in range(6):
        c[i] = r[i] - t[i]
    n = math.sqrt(t[6] * t[6] + t[7] * t[7]) + 1e-12
    a, b = r[6] - t[6], r[7] - t[7]
    c[6] = (-t[7] * a + t[6] * b) / n
    c[7] = r[8] - t[8]
    return c


@jit
def _con_jac(q, t):
    J = errors(q, t)[1]
    C = np.empty((8, 8))
    n = math.sqrt(t[6] * t[6] + t[7] * t[7]) + 1e-12
    for i in range(8):
        for k in range(6):
            C[k, i] = J[i, k]
        C[6, i] = (-t[7] * J[i, 6] + t[6] * J[i, 7]) / n
        C[7, i] = J[i, 8]
    return C


def make_slsqp(reach):
    """SciPy's minimize (SLSQP): least squares; in reach, pure equations are tried first."""
    from scipy.optimize import Bounds, minimize

    bounds = Bounds(LO, HI)
    stop2, scale, ftol, maxiter = (STOP2, 100.0, 1e-9, 60) if reach else (0.0, 1e3, 1e-11, 300)
    options = {"bounds": bounds, "options": {"ftol": ftol, "maxiter": maxiter}}
    short = {"bounds": bounds, "options": {"ftol": 1e-9, "maxiter": 12}}

    def squares(target, start):
        return minimize(cost, start, (target, stop2, scale), "SLSQP", True, **options).x

    def equations(target, start):
        con = {"type": "eq", "fun": _con, "jac": _con_jac, "args": (target,)}
        zero, flat = (lambda q: 0.0), (lambda q: np.zeros(8))
        q = minimize(zero, start, (), "SLSQP", flat, constraints=con, **short).x
        return q if cost(q, target, STOP2, 1.0)[0] == 0.0 else squares(target, start)

    return equations if reach else squares


@jit
def _squares(X, t, sines):
    """Squared residuals of many poses, X (8, n), or of their sines' angles."""
    p, f = np.empty(9), np.empty(X.shape[1])
    q = np.empty(8)
    for k in range(X.shape[1]):
        for i in range(8):
            q[i] = MID[i] + HALF[i] * math.sin(X[i, k]) if sines else X[i, k]
        f[k] = square(q, t, p)
    return f


def make_cma(reach):
    """cma's ask-and-tell CMAEvolutionStrategy over sines; gives up once it has collapsed."""
    import cma

    seeds = itertools.count(1)

    def solve(target, start):
        options = {"verbose": -9, "popsize": 17, "seed": next(seeds)}
        es = cma.CMAEvolutionStrategy(to_sines(start), 0.2, options)
        best, xb, last = 1e300, None, 1e300
        for g in range(300):
            X = es.ask()
            A = np.array(X)
            f = _squares(A.T, target, True)
            k = f.argmin()
            if f[k] < best:
                best, xb = f[k], A[k]
                if best < STOP2:
                    break
            es.tell(X, f.tolist(), check_points=False)
            if g % 10 == 9:
                if last - best < 1e-3 * last and f.max() < 1.5 * best:
                    break
                last = best
        return from_sines(xb)

    return solve


def make_de(reach):
    """SciPy's differential_evolution, vectorized; stops early and lets L-BFGS-B finish."""
    from scipy.optimize import Bounds, differential_evolution, minimize

    bounds = Bounds(LO, HI)
    polish = {"bounds": bounds, "options": {"ftol": 1e-7, "gtol": 1e-7, "maxiter": 60}}
    options = {"maxiter": 400, "popsize": 4, "tol": 0.02, "mutation": (0.5, 0.8)}
    options |= {"recombination": 0.9, "init": "random", "updating": "deferred", "vectorized": True}

    def stop(intermediate_result):
        return intermediate_result.fun < 1e-2

    def solve(target, start):
        def finish(func, x0, **_):
            r = minimize(cost, x0, (target, STOP2, 300.0), "L-BFGS-B", True, **polish)
            r.fun = float(square(r.x, target, np.empty(9)))
            return r

        return differential_evolution(
            lambda X: _squares(X, target, False),
            bounds,
            x0=start,
            polish=finish,
            callback=stop,
            **options,
        ).x

    return solve


def make_pymoo(reach):
    """pymoo's DE (best/1/bin), stepped by next(), without mutation; gives up once it stalls."""
    from pymoo.algorithms.soo.nonconvex.de import DE
    from pymoo.core.problem import Problem
    from pymoo.operators.mutation.nom import NoMutation

    class Residual(Problem):
        def __init__(self):
            super().__init__(n_var=8, n_obj=1, xl=LO, xu=HI)
            self.target, self.best, self.x = np.zeros(9), 1e300, None

        def _evaluate(self, X, out, *args, **kwargs):
            f = _squares(X.T, self.target, False)
            k = f.argmin()
            if f[k] < self.best:
                self.best, self.x = f[k], X[k].copy()
            out["F"] = f[:, None]

    problem = Residual()
    seeds = itertools.count(1)

    def solve(target, start):
        problem.target, problem.best = target, 1e300
        de = DE(pop_size=32, F=0.65, CR=0.85, output=None)
        de.mating.mutation = NoMutation()
        de.setup(problem, termination=("n_gen", 400), seed=next(seeds), verbose=False)
        last = 1e300
        for g in range(400):
            de.next()
            if problem.best < STOP2:
                break
            if g % 15 == 14:
                if last - problem.best < 1e-3 * last:
                    break
                last = problem.best
        return problem.x

    return solve
