"""Measures of agreement: kappas, Cronbach's alpha, the order of intensities, and intervals.

One person's answers are alike, so intervals treat each participant's answers as a cluster. Each
function returns None where it is not defined, for instance if all values are the same. Wilson's
interval is :func:`miburi.studies.trials.summary.wilson`.
"""

from collections.abc import Sequence
from itertools import combinations
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike

from miburi.errors import need

need("scipy", "studies")  # loading it takes a second, so only the functions that use it load it

#: The upper quantile of a 95 % interval.
_TWO_SIDED = 0.975


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

    ``counts`` tells how many people put each subject (row) into each category (column). The result
    is None unless every row has the same sum, 2 or more.
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
    """Return how many pairs of moods are rated in the right order, and how many pairs there are.

    A tie of ratings counts one half, so that guessing gives one half of the pairs (the probability
    of superiority, as in Mann and Whitney 1947).
    """
    pairs = combinations(zip(np.asarray(moods), np.asarray(ratings), strict=True), 2)
    signs = [np.sign(m - n) * np.sign(r - s) for (m, r), (n, s) in pairs if m != n]
    return float(sum((sign + 1) / 2 for sign in signs)), len(signs)


def unbiased_hit_rates(confusion: ArrayLike) -> list[float | None]:
    """Return Wagner's unbiased hit rate H_u (1993) of each row of a square table.

    The rate is the correct share of the answers in the row times the correct share of the answers
    in the column, so that always naming one feeling gains nothing. The rate is None for an empty
    row, and 0 if nobody chose the column.
    """
    table = np.asarray(confusion, dtype=np.float64)
    rows, columns = table.sum(axis=1), table.sum(axis=0)
    return [
        None if not rows[k] else float(table[k, k] ** 2 / (rows[k] * columns[k] or 1.0))
        for k in range(len(table))
    ]


def by_guessing(
    people: ArrayLike,
    shown: ArrayLike,
    chosen: ArrayLike,
    rows: ArrayLike,
    seed: int,
    permutations: int = 4999,
) -> list[tuple[float, float]]:
    """Return the share that guessing gets right, and p, for each row of a table.

    ``people``, ``shown`` and ``chosen`` have a value for each answer. ``rows``, (rows, answers),
    tells which answers belong to each row; a row has at least one.

    Guessing gives each person's answers to that person's films in a random order. This keeps
    people's favourite answers, and how often they chose no feeling. p is the one-sided probability
    that guessing gets at least as many answers right. It comes from ``permutations`` random orders,
    and is corrected for the number of rows (Holm 1979).
    """
    who, named, given, within = map(np.asarray, (people, shown, chosen, rows))
    rng = np.random.default_rng(seed)
    likely, hits = np.zeros(len(who)), np.zeros((permutations, len(within)), dtype=np.int64)
    for person in np.unique(who):
        own = who == person
        likely[own] = (given[own] == named[own, None]).mean(axis=1)
        places = np.tile(np.arange(own.sum()), (permutations, 1))
        dealt = given[own][rng.permuted(places, axis=1)]
        hits += (dealt == named[own]) @ within[:, own].T.astype(np.int64)
    as_many = (hits >= within @ (given == named).astype(np.int64)).sum(axis=0)
    values = (as_many + 1) / (permutations + 1)
    order = np.argsort(values)
    stepped = values[order] * np.arange(len(values), 0, -1)
    values[order] = np.minimum(np.maximum.accumulate(stepped), 1.0)
    return [(float(likely[row].mean()), float(p)) for row, p in zip(within, values, strict=True)]


def mean_interval(clusters: Sequence[Sequence[float]]) -> tuple[float, float] | None:
    """Return the 95 % interval of the mean of clustered values.

    Return None if there are fewer than two clusters.
    """
    if (found := _mean_of(clusters)) is None:
        return None
    mean, variance, quantile, _ = found
    half = quantile * sqrt(variance)
    return mean - half, mean + half


def share_interval(clusters: Sequence[Sequence[bool]]) -> tuple[float, float] | None:
    """Return the 95 % interval of a share with clustered hits; None for fewer than two clusters.

    The interval is Wilson's (1927) with Student's quantile, for the effective number of answers:
    the number of answers divided by the design effect of the variance in :func:`mean_interval`,
    which counts as 1 at least. If all answers are the same, each cluster counts as one answer.
    """
    if (found := _mean_of(clusters)) is None:
        return None
    share, variance, z, count = found
    alone = share * (1 - share) / count
    worth = count / max(variance / alone, 1.0) if alone else len(clusters)
    a = z * z / (2 * worth)
    half = z * sqrt(share * (1 - share) / worth + a / (2 * worth))
    return (share + a - half) / (1 + 2 * a), (share + a + half) / (1 + 2 * a)


def _mean_of(clusters: Sequence[Sequence[float]]) -> tuple[float, float, float, int] | None:
    """Return the mean of clustered values, its variance, t, and the number of values.

    Return None if there are fewer than two clusters. The variance is that of a ratio of cluster
    totals, linearised (Cochran, Sampling Techniques, 6.3); t is Student's quantile for
    (clusters - 1) degrees of freedom.
    """
    if (groups := len(clusters)) < 2:
        return None
    from scipy.stats import t

    count = sum(map(len, clusters))
    mean = sum(map(sum, clusters)) / count
    spread = sum((sum(values) - mean * len(values)) ** 2 for values in clusters)
    variance = spread * groups / (groups - 1) / count**2
    return mean, variance, float(t.ppf(_TWO_SIDED, groups - 1)), count


def _above_chance(observed: float, chance: float) -> float | None:
    return None if chance >= 1 else (observed - chance) / (1 - chance)
