"""The order of a participant's films: a balanced Latin square.

The seed assigns the films to the numbers in the square.

In a balanced square every film has every place once, and follows every other film once (Williams
1949, "Experimental designs balanced for the estimation of residual effects of treatments",
Australian Journal of Scientific Research 2): n rows for an even number of films, 2n for an odd one.
Participant k gets row k; the next block of participants gets the same square with shuffled films.
"""

import numpy as np

from miburi.studies.study.plan import Film, Study


def balanced_square(count: int) -> list[tuple[int, ...]]:
    """Return Williams's square for ``count`` films: rows of 0 … ``count`` - 1."""
    # 0, 1, n - 1, 2, n - 2, …: for an even n, each difference of neighbours (mod n) occurs once.
    first = [(k + 1) // 2 if k % 2 else (count - k // 2) % count for k in range(count)]
    rows = [tuple((film + row) % count for film in first) for row in range(count)]
    return rows if count % 2 == 0 else [*rows, *(row[::-1] for row in rows)]


def film_order(count: int, trials: int, participant: int, seed: int) -> tuple[int, ...]:
    """Return which of ``count`` films a participant, numbered from 1, sees in each trial.

    The first ``count`` trials show the films of one row of the square; further trials continue with
    the next rows.
    """
    rows = balanced_square(count)
    block, row = divmod(participant - 1, len(rows))
    labels = np.random.default_rng([seed, block]).permutation(count)
    turns = range(-(-trials // count))
    shown = [film for turn in turns for film in rows[(row + turn) % len(rows)]]
    return tuple(int(labels[film]) for film in shown[:trials])


def film_at(study: Study, place: int, step: int) -> Film | None:
    """Return the film of a page, counted from 0, for a participant at a place, counted from 1."""
    trial = study.steps[step].trial if step < len(study.steps) else None
    if trial is None:
        return None
    films, trials = study.films, study.trials or len(study.films)
    if trial < 0:  # practice, with the same films for everybody
        return films[film_order(len(films), study.practice, 1, study.seed + 1)[trial]]
    return films[film_order(len(films), trials, place, study.seed)[trial]]


def option_order(options: tuple[str, ...], participant: int, seed: int) -> tuple[str, ...]:
    """Return the options in one participant's order, the same on every page."""
    order = np.random.default_rng([seed, participant, 1]).permutation(len(options))
    return tuple(options[index] for index in order)
