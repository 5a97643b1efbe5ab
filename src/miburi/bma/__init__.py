"""Minimise any function within bounds by the Bacterial Memetic Algorithm (the paper's Section 3).

>>> from miburi import bma
>>> result = bma.minimize(lambda x: (x[0] - 1) ** 2 + x[1] ** 2, [(-2, 2), (-2, 2)], seed=1)
>>> bool(abs(result.x[0] - 1) < 1e-6)
True

Where the function is slow or runs elsewhere, ask the search for points and report their values:

>>> search = bma.Optimizer([(-2, 2), (-2, 2)], seed=1)
>>> while not search.finished:
...     points = search.ask()
...     search.tell([(x - 1) ** 2 + y**2 for x, y in points])
"""

from miburi.bma.minimise import minimize, scipy_method
from miburi.bma.search import Optimizer
from miburi.bma.settings import (
    BUDGET_SPENT,
    CONVERGED,
    DEADLINE,
    NOTHING_ALLOWED,
    SETTLED,
    STOPPED,
    SearchResult,
    Settings,
)

__all__ = [
    "BUDGET_SPENT",
    "CONVERGED",
    "DEADLINE",
    "NOTHING_ALLOWED",
    "SETTLED",
    "STOPPED",
    "Optimizer",
    "SearchResult",
    "Settings",
    "minimize",
    "scipy_method",
]
