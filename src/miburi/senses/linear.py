"""Small linear models, which turn groups of words and letters (n-grams) into meanings' likelihoods.

``tools/linear_model.py`` trains them. A model is a file of arrays: the hashes of the groups that it
knows, the groups' weights in eight bits, and a bias for each meaning.
"""

from collections.abc import Callable, Iterable
from importlib.resources.abc import Traversable
from itertools import pairwise
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from miburi.languages import Language, is_spaced

Likelihoods = NDArray[np.float64]


def groups_of(said: str, language: Language) -> set[str]:
    """Return the groups of words (n-grams, and pairs with a gap) and of letters in plain text."""
    if not is_spaced(language):
        text = f"^{said}$"
        return {f"1{text[i : i + n]}" for n in range(1, 6) for i in range(len(text) - n + 1)}
    words = ["^", *said.split(), "$"]
    groups = {f"1{word}" for word in words}
    groups |= {f"2{a} {b}" for a, b in pairwise(words)}
    groups |= {f"3{' '.join(words[i : i + 3])}" for i in range(len(words) - 2)}
    for gap in (2, 3):
        groups |= {f"4{a} {b}" for a, b in zip(words, words[gap:], strict=False)}
    for word in words[1:-1]:
        edged = f"^{word}$"
        groups |= {f"5{edged[i : i + n]}" for n in (3, 4, 5) for i in range(len(edged) - n + 1)}
    return groups


def numbered(groups: Iterable[str]) -> list[int]:
    """Return the ids of groups of letters and words, in ascending order."""
    return sorted({crc32(group.encode()) for group in groups})


def find(
    keys: NDArray[np.uint32], numbers: NDArray[np.uint32]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the indices of the numbers that are among the sorted keys, and their places there."""
    place = np.minimum(np.searchsorted(keys, numbers), len(keys) - 1)
    known = np.flatnonzero(keys[place] == numbers)
    return known, place[known]


def softmax(score: NDArray[np.float64]) -> Likelihoods:
    """Return likelihoods, (n,), from scores, which are log-likelihoods up to a common constant."""
    odds = np.exp(score - score.max())
    return np.asarray(odds / odds.sum(), dtype=np.float64)


def load_model(file: Traversable, language: Language) -> Callable[[list[int]], Likelihoods] | None:
    """Return a function from the ids of groups to likelihoods, (n,).

    Return None if the file has no model of the language.
    """
    with file.open("rb") as opened:
        stored = dict(np.load(opened))
    if f"{language}_keys" not in stored:
        return None
    keys, weights, scale, bias = (
        stored[f"{language}_{part}"] for part in ("keys", "weights", "scale", "bias")
    )

    def likelihoods(groups: list[int]) -> Likelihoods:
        _, place = find(keys, np.array(groups, dtype=np.uint32))
        return softmax(bias + weights[place].sum(axis=0) * scale / np.sqrt(max(len(groups), 1)))

    return likelihoods
