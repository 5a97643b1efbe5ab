"""Minimise a function in a box with one call, directly or through SciPy."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from miburi.bma.local import Jacobian
from miburi.bma.search import Optimizer
from miburi.bma.settings import (
    BUDGET_SPENT,
    CONVERGED,
    DEADLINE,
    SETTLED,
    STOPPED,
    Array,
    SearchResult,
    Settings,
    checked_settings,
)
from miburi.errors import InputError
from miburi.ground.arguments import Seed, clock_limit


def minimize(
    function: Callable[[Array], Any],
    bounds: ArrayLike,
    *,
    start: ArrayLike | None = None,
    settings: Settings | None = None,
    seed: Seed = 0,
    deadline: float | None = None,
    callback: Callable[[SearchResult], bool | None] | None = None,
    jacobian: Jacobian | None = None,
) -> SearchResult:
    """Find the least value of a function in a box.

    Parameters
    ----------
    function
        Takes a point, (n,), and returns either a number or residuals, (m,), whose sum of squares is
        minimised. An array of one element counts as a number, unless the settings ask for
        residuals. Infinity marks a point that is not allowed.
    bounds, start, settings, seed, jacobian
        As in :class:`Optimizer`. The function is never called at a point outside the bounds.
    deadline
        The time limit in seconds, above 0; once it has passed, the best point so far is returned.
    callback
        Called after each generation with the best result so far. The callback ends the search by
        returning a true value or by raising StopIteration.

    Raises
    ------
    InputError
        An argument is not as described above, or the function returned NaN or a non-number.
    RuntimeError
        The function raised StopIteration; any other exception passes through.
    """
    limit = clock_limit(deadline)
    search = Optimizer(bounds, start=start, settings=settings, seed=seed, jacobian=jacobian)
    generations = 0
    while not search.finished:
        try:
            values = [function(point) for point in search.ask()]
        except StopIteration as error:
            raise RuntimeError("The function raised StopIteration.") from error
        search.tell(values)
        if callback is not None and search.result.generations > generations:
            generations = search.result.generations
            try:
                stopped = callback(search.result)
            except StopIteration:
                stopped = True
            if stopped:
                search.stop(STOPPED)
        if time.perf_counter() >= limit:
            search.stop(DEADLINE)
    return search.result


def scipy_method(
    fun: Callable[..., Any],
    x0: ArrayLike,
    args: tuple[Any, ...] = (),
    *,
    bounds: Any = None,
    callback: Callable[[Any], Any] | None = None,
    constraints: Any = (),
    jac: Any = None,
    hess: Any = None,  # noqa: ARG001  (SciPy always passes it)
    hessp: Any = None,  # noqa: ARG001  (as hess)
    settings: Settings | None = None,
    seed: Seed = 0,
    deadline: float | None = None,
    maxiter: int | None = None,
    tol: float | None = None,
    **unknown: Any,
) -> Any:
    """Serve as ``method`` of ``scipy.optimize.minimize``.

    Call ``scipy.optimize.minimize(f, x0, method=bma.scipy_method, bounds=…, options={"seed": 1})``.
    The options are settings, seed and deadline, as in :func:`minimize`, and SciPy's own maxiter
    (generations) and tol (the length of the gradient at which a local search ends). ``jac`` is
    used, but the Hessian is not.

    Returns
    -------
    A scipy.optimize.OptimizeResult. If the search converged or settled, ``success`` is true and
    ``status`` is 0. Otherwise ``status`` is 1 if the budget was spent, and 2 if not.

    Raises
    ------
    InputError
        As in :func:`minimize`; also if there are no bounds, if there are constraints, or if an
        option is unknown.
    """
    from scipy.optimize import OptimizeResult

    if bounds is None:
        raise InputError(
            "The memetic algorithm searches a box; pass bounds=[(least, greatest), …]."
        )
    if unknown:
        raise InputError(
            "The options are settings, seed, deadline, maxiter and tol, "
            f"got {', '.join(sorted(unknown))}."
        )
    if constraints:
        raise InputError("The memetic algorithm takes no constraints but bounds; leave others out.")
    if not isinstance(bounds, list | tuple | np.ndarray):  # scipy.optimize.Bounds
        bounds = np.column_stack(np.broadcast_arrays(bounds.lb, bounds.ub, np.asarray(x0))[:2])
    settings = checked_settings(settings)
    settings = settings if maxiter is None else replace(settings, generations=maxiter)
    settings = settings if tol is None else replace(settings, gradient_tolerance=tol)
    found = minimize(
        lambda x: fun(x, *args),
        bounds,
        start=x0,
        settings=settings,
        jacobian=(lambda x: jac(x, *args)) if callable(jac) else None,
        seed=seed,
        deadline=deadline,
        callback=None if callback is None else lambda result: callback(result.x),
    )
    return OptimizeResult(
        x=found.x,
        fun=found.value,
        nfev=found.evaluations,
        nit=found.generations,
        success=found.status in (CONVERGED, SETTLED),
        status={CONVERGED: 0, SETTLED: 0, BUDGET_SPENT: 1}.get(found.status, 2),
        message=found.status,
    )
