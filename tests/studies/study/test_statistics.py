"""The statistics agree with examples that others have published."""

import numpy as np
import pytest

from miburi.studies.study.statistics import (
    by_guessing,
    cohen_kappa,
    cronbach_alpha,
    fleiss_kappa,
    right_order,
)


@pytest.mark.parametrize(
    ("table", "kappa"),
    [
        ([[20, 5], [10, 15]], 0.4),  # Wikipedia, Cohen's kappa: 50 grant proposals
        ([[45, 15], [25, 15]], 0.1304),  # there, too: the same agreement, other margins
        ([[25, 35], [5, 35]], 0.2593),
        ([[2, 0, 0], [0, 0, 1], [1, 0, 2]], 0.4286),  # scikit-learn's example
    ],
)
def test_cohens_kappa(table: list[list[int]], kappa: float) -> None:
    assert cohen_kappa(table) == pytest.approx(kappa, abs=1e-4)


def test_fleisss_kappa_of_14_psychiatrists() -> None:
    """Wikipedia and R's irr print 0.210 for this table."""
    table = [
        [0, 0, 0, 0, 14], [0, 2, 6, 4, 2], [0, 0, 3, 5, 6], [0, 3, 9, 2, 0], [2, 2, 8, 1, 1],
        [7, 7, 0, 0, 0], [3, 2, 6, 3, 0], [2, 5, 3, 2, 2], [6, 5, 2, 1, 0], [0, 2, 2, 3, 7],
    ]  # fmt: skip
    assert fleiss_kappa(table) == pytest.approx(0.210, abs=5e-4)


def test_what_is_not_defined_is_none() -> None:
    assert cohen_kappa([[0, 0], [0, 0]]) is None
    assert cohen_kappa([[9, 0], [0, 0]]) is None  # all in one place: chance agrees as well
    assert fleiss_kappa([]) is None
    assert fleiss_kappa([[1, 0], [0, 1]]) is None  # one person
    assert fleiss_kappa([[2, 0], [2, 1]]) is None  # not the same number of people
    assert cronbach_alpha([]) is None
    assert cronbach_alpha([[1, 2, 3]]) is None
    assert cronbach_alpha([[1, 2], [1, 2]]) is None  # nobody differs


def test_pairs_in_order_with_a_tie() -> None:
    assert right_order([0.3, 0.6, 0.9], [1, 4, 4]) == (2.5, 3)
    assert right_order([0.9, 0.3], [1, 7]) == (0, 1)
    assert right_order([0.6, 0.6], [1, 7]) == (0, 0)


def test_guessing_by_hand() -> None:
    """One person's two answers are dealt in two ways; "none" is right in neither."""
    shown = ["fear", "anger"]
    ((chance, p),) = by_guessing([1, 1], shown, shown, [[True, True]], 1)
    assert (chance, p) == (0.5, pytest.approx(0.5, abs=0.03))
    ((chance, p),) = by_guessing([1, 1], shown, ["fear", "none"], [[True, True]], 1)
    assert (chance, p) == (0.25, pytest.approx(0.5, abs=0.03))
    assert by_guessing([], [], [], [], 1) == []


def test_favourite_feelings_are_not_taken_for_recognition() -> None:
    """Twenty people guess by 24 films of eight feelings, and each has favourites.

    p is below 0.05 in about 5 % of the studies, overall and in any of the eight rows.
    """
    rng, overall, rows, studies = np.random.default_rng(1), 0, 0, 200
    who, shown = np.repeat(np.arange(20), 24), np.tile(np.arange(24) % 8, 20)
    of_feeling = [shown == feeling for feeling in range(8)]
    for seed in range(studies):
        tastes = rng.dirichlet([0.5] * 8, 20)
        chosen = np.concatenate([rng.choice(8, 24, p=taste) for taste in tastes])
        ((chance, p),) = by_guessing(who, shown, chosen, [shown >= 0], seed, 199)
        assert chance == pytest.approx(1 / 8)
        overall += p <= 0.05
        rows += min(p for _, p in by_guessing(who, shown, chosen, of_feeling, seed, 999)) <= 0.05
    assert max(overall, rows) <= 0.08 * studies
