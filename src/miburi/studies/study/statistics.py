"""How people agree: kappas, Cronbach's alpha, and the order of intensities.

Small functions of tables of numbers. Each returns None where it is not defined, for instance
where all values are the same. Wilson's interval is :func:`miburi.studies.trials.summary.wilson`.
"""

from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

__all__ = ["cohen_kappa", "cronbach_alpha", "fleiss_kappa", "right_order"]


def cohen_kappa(confusion: ArrayLike) -> float | None:
    """Return Cohen's kappa (1960) of a square table: rows one judgement, columns the other."""
    table = np.asarray(confusion, dtype=np.float64)
    total = table.sum()
    if total == 0:
        return None
    chance = float(table.sum(axis=0) @ table.sum(axis=1)) / total**2
    return _above_chance(float(np.trace(table)) / total, chance)


def fleiss_kappa(counts: ArrayLike) -> float | None:
    """Return Fleiss's kappa (1971).

    ``counts`` tells how many people put each subject (row) into each category (column); every
    row has the same sum, 2 or more. None if not.
    """
    table = np.asarray(counts, dtype=np.float64)
    people = table.sum(axis=1) if table.size else np.zeros(1)
    many = float(people[0])
    if many < 2 or np.any(people != many):
        return None
    observed = ((table**2).sum(axis=1) - many) / (many * (many - 1))
    shares = table.sum(axis=0) / table.sum()
    return _above_chance(float(observed.mean()), float(shares @ shares))


def cronbach_alpha(values: ArrayLike) -> float | None:
    """Return Cronbach's alpha (1951) of answers (rows) to the items of a scale (columns)."""
    table = np.asarray(values, dtype=np.float64)
    if table.ndim != 2 or len(table) < 2 or table.shape[1] < 2:
        return None
    items = int(table.shape[1])
    total = float(table.sum(axis=1).var(ddof=1))
    each = float(table.var(axis=0, ddof=1).sum())
    if total == 0:
        return None
    return items / (items - 1) * (1 - each / total)


def right_order(moods: ArrayLike, ratings: ArrayLike) -> tuple[float, int]:
    """Return how many pairs with different moods have their ratings in the same order, of all.

    A tie of ratings counts one half, so that guessing gives one half of the pairs (the
    probability of superiority, as in Mann and Whitney 1947).
    """
    pairs = combinations(zip(np.asarray(moods), np.asarray(ratings), strict=True), 2)
    signs = [np.sign(m - n) * np.sign(r - s) for (m, r), (n, s) in pairs if m != n]
    return float(sum((sign + 1) / 2 for sign in signs)), len(signs)


def _above_chance(observed: float, chance: float) -> float | None:
    return None if chance >= 1 else (observed - chance) / (1 - chance)
