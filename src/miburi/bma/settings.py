"""The settings of the Bacterial Memetic Algorithm (Table 2), its result, and why it ended."""

import time
from dataclasses import dataclass
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import NDArray

from miburi.errors import InputError

__all__ = [
    "BUDGET_SPENT",
    "CONVERGED",
    "DEADLINE",
    "SETTLED",
    "STOPPED",
    "Array",
    "SearchResult",
    "Seed",
    "Settings",
    "clock_limit",
    "real_numbers",
    "seed_of",
]

Array = NDArray[np.float64]
Seed = int | np.random.Generator

#: Why a search ended, in words.
CONVERGED = "converged"
SETTLED = "settled: no better value found"
BUDGET_SPENT = "budget spent"
DEADLINE = "stopped by deadline"
STOPPED = "stopped by callback"


@dataclass(frozen=True)
class Settings:
    """How the algorithm works; the paper's numbers are those of Table 2.

    The default keeps Table 2 and changes what follows it, which is ours: a local search from the
    starting point comes before everything else, each generation begins with local searches, and
    the search ends at ``target`` or once it has settled. :meth:`paper` changes nothing.

    Parameters
    ----------
    generations
        N_gen, at most this many, from 0.
    individuals
        N_ind, from 2.
    clones
        N_clones, from 2; one of them stays as the original is.
    segment
        l_bm, variables in a segment of bacterial mutation, from 1.
    transfers
        N_inf, gene transfers in a generation, from 0.
    transferred
        l_gt, variables in a gene transfer, from 1.
    local_probability
        LM_prob, 0 to 1.
    local_iterations
        LM_iter, from 0.
    damping
        γ_init, above 0.
    gradient_tolerance
        τ: a local search ends where the gradient is shorter, from 0.
    local_search
        "gradient" is Eq. 12 as printed; "residual" is Levenberg-Marquardt on the residuals,
        (JᵀJ + γI)s = -Jᵀe, as in the paper's reference [9], for functions that return residuals.
    ends
        How many clones with one variable at an end of its range are searched from where a
        residual search ends; 0, as in the paper, leaves them out.
    local_first
        Whether a generation begins with its local searches, or with bacterial mutation, as the
        paper's does.
    first_iterations
        Iterations of the local search before the population is made, from the starting point
        and from the middle of the box; 0 leaves it out, as the paper does.
    target
        The search has converged at a value not above this; ``-inf`` never stops it. None is 1e-12
        for residuals, whose sum of squares is at least 0, and ``-inf`` for any other function.
    patience
        The search has settled after this many local searches in a row, of the population, that
        found nothing better; 0 never stops it, as in the paper.

    Raises
    ------
    InputError
        A value is not allowed; the message says what is.
    """

    generations: int = 35
    individuals: int = 12
    clones: int = 10
    segment: int = 1
    transfers: int = 15
    transferred: int = 1
    local_probability: float = 0.2
    local_iterations: int = 8
    damping: float = 1.0
    gradient_tolerance: float = 1e-4
    local_search: Literal["gradient", "residual"] = "gradient"
    ends: int = 0
    local_first: bool = True
    first_iterations: int = 8
    target: float | None = None
    patience: int = 36

    def __post_init__(self) -> None:
        for name, least in _SMALLEST.items():
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or value < least:
                raise InputError(f"{name} must be a whole number from {least}, got {value!r}.")
        for name, (low, high) in _RANGES.items():
            value = getattr(self, name)
            if name == "target" and value is None:
                continue
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise InputError(f"{name} must be a number, got {value!r}.")
            if not low <= value <= high:
                raise InputError(f"{name} must lie from {low} to {high}, got {value}.")
        if not isinstance(self.local_first, bool):
            raise InputError(f"local_first must be True or False, got {self.local_first!r}.")
        if self.local_search not in ("gradient", "residual"):
            raise InputError(
                f'local_search must be "gradient" or "residual", got {self.local_search!r}.'
            )

    def enough(self, of_residuals: bool) -> float:
        """Return ``target``, or what None stands for with residuals or without."""
        if self.target is not None:
            return self.target
        return 1e-12 if of_residuals else -np.inf

    @classmethod
    def paper(cls) -> Self:
        """Table 2 and Section 3 as printed: Eq. 12, mutation first, all 35 generations."""
        return cls(local_first=False, first_iterations=0, target=-np.inf, patience=0)


_SMALLEST = {
    "generations": 0,
    "individuals": 2,
    "clones": 2,
    "segment": 1,
    "transfers": 0,
    "transferred": 1,
    "local_iterations": 0,
    "ends": 0,
    "first_iterations": 0,
    "patience": 0,
}
_TINY, _HUGE = 1e-300, 1e300
_RANGES = {
    "local_probability": (0.0, 1.0),
    "damping": (_TINY, _HUGE),
    "gradient_tolerance": (0.0, _HUGE),
    "target": (-np.inf, _HUGE),
}


@dataclass(frozen=True)
class SearchResult:
    """What a search found.

    Parameters
    ----------
    x
        The best point, (n,), inside the bounds.
    value
        The function there (of residuals, the sum of squares).
    evaluations
        How many points were evaluated.
    generations
        How many generations were begun.
    status
        Why it ended: one of ``CONVERGED``, ``SETTLED``, ``BUDGET_SPENT``, ``DEADLINE``,
        ``STOPPED``.
    """

    x: Array
    value: float
    evaluations: int
    generations: int
    status: str


def clock_limit(deadline: float | None) -> float:
    """When ``deadline`` seconds from now will have passed, on the clock of ``perf_counter``.

    Raises
    ------
    InputError
        The deadline is not above 0.
    """
    if deadline is None:
        return np.inf
    if not isinstance(deadline, int | float | np.number) or not deadline > 0:
        raise InputError(f"deadline must be a number above 0 s, got {deadline!r}.")
    return time.perf_counter() + deadline


def seed_of(seed: Any) -> int:
    """Return the number from 0 to 2**63 - 1 that a seed or a generator stands for.

    Raises
    ------
    InputError
        The seed is neither such a number nor a NumPy generator.
    """
    if type(seed) is int and 0 <= seed < 1 << 63:
        return seed
    if isinstance(seed, np.random.Generator):
        return int(seed.integers(1 << 63))
    if not isinstance(seed, np.integer) or not 0 <= seed < 1 << 63:
        raise InputError(
            f"seed must be a whole number from 0 to 2**63 - 1, or a NumPy generator, got {seed!r}."
        )
    return int(seed)


def real_numbers(values: Any) -> Array:
    """Return a copy of ``values`` as contiguous float64.

    Raises
    ------
    TypeError, ValueError
        They are not numbers, not real ones, or some of them are masked.
    """
    array = np.asarray(values)
    rows = [values, *values] if isinstance(values, list | tuple) else [values]
    if np.iscomplexobj(array) or any(map(np.ma.is_masked, rows)):
        raise TypeError("complex and masked numbers have no place here")
    return np.array(array, dtype=np.float64, order="C")
