"""Orders are balanced, and the same seed gives the same."""

from collections import Counter
from itertools import pairwise

import pytest

from miburi.studies.study.order import balanced_square, film_order, option_order


def test_the_square_of_four_is_williamss() -> None:
    assert balanced_square(4) == [(0, 1, 3, 2), (1, 2, 0, 3), (2, 3, 1, 0), (3, 0, 2, 1)]


@pytest.mark.parametrize("count", [1, 2, 3, 8])
def test_every_film_stands_everywhere_and_follows_every_other_equally_often(count: int) -> None:
    rows = [film_order(count, count, p + 1, seed=5) for p in range(len(balanced_square(count)))]
    often = len(rows) // count
    places = Counter(place for row in rows for place in enumerate(row))
    assert places == {(k, film): often for k in range(count) for film in range(count)}
    follows = Counter(pair for row in rows for pair in pairwise(row))
    assert follows == {
        (a, b): often for a in range(count) for b in range(count) if a != b and count > 1
    }


def test_fewer_and_more_trials_than_films() -> None:
    whole = film_order(4, 4, 3, seed=1)
    assert film_order(4, 2, 3, seed=1) == whole[:2]
    more = film_order(4, 8, 3, seed=1)
    assert more[:4] == whole
    assert Counter(more) == dict.fromkeys(range(4), 2)


def test_orders_depend_on_the_seed_and_the_participant_alone() -> None:
    def orders(seed: int) -> list[tuple[int, ...]]:
        return [film_order(8, 8, participant, seed) for participant in range(1, 25)]

    assert orders(1) == orders(1) != orders(2)
    assert len(set(orders(1))) == 24  # the next block of eight has other rows
    options = ("fear", "fright", "anger", "disgust")
    assert option_order(options, 1, 1) == option_order(options, 1, 1)
    assert len({option_order(options, participant, 1) for participant in range(20)}) > 5
