"""The settings of the Bacterial Memetic Algorithm (Table 2), its result, and why it ended."""

from dataclasses import dataclass
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import NDArray

from miburi.errors import InputError

Array = NDArray[np.float64]

#: Why a search ended, in words.
CONVERGED = "converged"
SETTLED = "settled: no better value found"
BUDGET_SPENT = "budget spent"
DEADLINE = "stopped by deadline"
NOTHING_ALLOWED = "no allowed point found"
STOPPED = "stopped by callback"


@dataclass(frozen=True)
class Settings:
    """How the algorithm works; the paper's numbers are those of Table 2.

    The default keeps the population of Table 2. The rest is ours: a local search from the starting
    point comes first, each generation begins with local searches, their steps do not depend on
    units, and the search ends at ``target`` or once it has settled. :meth:`paper` is Table 2 and
    Section 3 as printed.

    Parameters
    ----------
    generations, individuals, clones
        The paper's N_gen, at least 0, and its N_ind and N_clones, at least 2. N_ind times N_clones
        is at most a million. One of the clones stays the same as the original.
    segment, transfers, transferred
        l_bm, the number of variables in a segment of bacterial mutation, at least 1; N_inf, the
        number of gene transfers in a generation, at least 0; and l_gt, the number of variables in a
        gene transfer, at least 1.
    local_probability, local_iterations
        LM_prob, the probability of a local search, from 0 to 1; and LM_iter, its number of
        iterations, at least 0.
    damping, gradient_tolerance
        γ_init, above 0; with ``relative``, γ_init is a share of the greatest curvature. The
        tolerance τ is at least 0: a local search ends once the norm of the gradient is at most τ.
    local_search
        "printed" is Eq. 12; "gradient" learns the curvature from the gradients it meets (BFGS);
        "residual" is Levenberg-Marquardt on the residuals, (JᵀJ + γI)s = -Jᵀe, as in the paper's
        reference [9], for functions that return residuals.
    relative
        Whether steps measure each variable in shares of its range, and γ as a share of the
        curvature, so that no result depends on a unit. "printed" uses only absolute numbers.
    ends
        When a residual search has ended, it starts again from this many clones of its last point,
        each with one variable at an end of its range; 0, as in the paper, leaves this out.
    local_first
        Whether a generation begins with local searches or, as in the paper, with mutation.
    first_iterations
        How many iterations the local searches from the start and from the middle of the box may
        take before there is a population; 0, as in the paper, leaves these searches out.
    target
        The search has converged once a value is not above this; with ``-inf`` it never converges.
        None means ``-inf`` or, for residuals, 1e-20 of the sum of squares at the start.
    patience
        The search counts as settled after this many local searches of the population in a row have
        brought no improvement; with 0, as in the paper, it never counts as settled.

    Raises
    ------
    InputError
        A value is not allowed; the message says which values are.
    """

    generations: int = 35
    individuals: int = 12
    clones: int = 10
    segment: int = 1
    transfers: int = 15
    transferred: int = 1
    local_probability: float = 0.2
    local_iterations: int = 30
    damping: float = 1e-3
    gradient_tolerance: float = 0.0
    local_search: Literal["printed", "gradient", "residual"] = "gradient"
    relative: bool = True
    ends: int = 0
    local_first: bool = True
    first_iterations: int = 100
    target: float | None = None
    patience: int = 36

    def __post_init__(self) -> None:
        for name in _COUNTS:
            value, least = getattr(self, name), _LEAST.get(name, 0)
            if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= _MOST:
                raise InputError(
                    f"{name} must be a whole number from {least} to {_MOST}, got {value!r}."
                )
        if self.individuals * self.clones > _MOST:
            raise InputError(
                f"individuals times clones must be at most {_MOST}, "
                f"got {self.individuals} and {self.clones}."
            )
        for name, (low, high) in _RANGES.items():
            value = getattr(self, name)
            if name == "target" and value is None:
                continue
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise InputError(f"{name} must be a number, got {value!r}.")
            if not low <= value <= high:
                raise InputError(f"{name} must lie from {low} to {high}, got {value}.")
        for name in ("local_first", "relative"):
            if not isinstance(getattr(self, name), bool):
                raise InputError(f"{name} must be True or False, got {getattr(self, name)!r}.")
        if self.local_search not in _SEARCHES:
            raise InputError(
                f"local_search must be one of {', '.join(_SEARCHES)}, got {self.local_search!r}."
            )

    @classmethod
    def paper(cls) -> Self:
        """Table 2 and Section 3 as printed: Eq. 12, mutation first, all 35 generations."""
        return cls(
            local_iterations=8,
            damping=1.0,
            gradient_tolerance=1e-4,
            local_search="printed",
            relative=False,
            local_first=False,
            first_iterations=0,
            target=-np.inf,
            patience=0,
        )


_SEARCHES = ("printed", "gradient", "residual")
_MOST = 1_000_000
#: The least values of the counts that must not be 0; the other counts may be 0.
_LEAST = {"individuals": 2, "clones": 2, "segment": 1, "transferred": 1}
_COUNTS = tuple(name for name, kind in Settings.__annotations__.items() if kind is int)
_TINY, _HUGE = 1e-300, 1e300
_RANGES = {
    "local_probability": (0.0, 1.0),
    "damping": (_TINY, _HUGE),
    "gradient_tolerance": (0.0, _HUGE),
    "target": (-np.inf, _HUGE),
}


@dataclass(frozen=True)
class SearchResult:
    """The result of a search.

    Parameters
    ----------
    x, value
        The best point, (n,), inside the bounds, and its value (for residuals, the sum of squares).
    evaluations, generations
        Number of points evaluated; number of generations begun.
    status
        Why it ended: one of ``CONVERGED``, ``SETTLED``, ``BUDGET_SPENT``, ``NOTHING_ALLOWED``
        (the value is infinite), ``DEADLINE``, ``STOPPED``.
    """

    x: Array
    value: float
    evaluations: int
    generations: int
    status: str


def checked_settings(settings: Any) -> Settings:
    """Return the settings given, or the default for None; InputError for anything else."""
    if settings is not None and not isinstance(settings, Settings):
        raise InputError(f"settings must be bma.Settings or None, got {settings!r}.")
    return settings or Settings()
