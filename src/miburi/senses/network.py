"""A small convolutional network of words (Kim 2014), used alongside the linear models.

A linear model knows only what it was trained on. For English, the network starts from word vectors
that others trained (GloVe 6B, Pennington et al. 2014, public domain), so it knows that a "forearm"
is much like a "wrist". For Japanese, it learns vectors of characters and of pairs of characters.
The network and the linear model make different mistakes, so :func:`agreed` combines the two.
``tools/train_network.py`` trains the network on the same sentences as the linear models.
"""

from collections.abc import Callable
from importlib import resources
from importlib.resources.abc import Traversable
from itertools import pairwise, zip_longest
from typing import Any
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from miburi.languages import Language, is_spaced
from miburi.senses.linear import Likelihoods, find, softmax

_FILE = resources.files(__package__) / "network.npz"
#: The width of the widest filter, and the number of empty places before and after a sentence, which
#: let filters see its first and last words.
MARGIN = 4
_WIDTHS = range(1, MARGIN + 1)
#: The number of filters that are multiplied at once. With so few, OpenBLAS starts no threads, which
#: would take twice the processor's time without a gain.
_PIECE = 64

Floats = NDArray[np.float32]


def steps_of(said: str, language: Language) -> list[list[int]]:
    """Return, for each place in normalised text, the ids of the tokens there.

    A place has one word or, in a language without spaces, one character and the pair of it and the
    next character.
    """
    spaced = is_spaced(language)
    parts = said.split() if spaced else list(said)
    pairs = [] if spaced else [a + b for a, b in pairwise(parts)]
    return [[crc32(each.encode()) for each in here if each] for here in zip_longest(parts, pairs)]


def agreed(one: Likelihoods, other: Likelihoods) -> Likelihoods:
    """Return the normalised geometric mean of the likelihoods, (n,), from two models."""
    both = np.sqrt(one * other)
    return np.asarray(both / both.sum(), dtype=np.float64)


def load_network(
    head: str, language: Language, file: Traversable = _FILE
) -> Callable[[str], Likelihoods] | None:
    """Return a function from plain words to likelihoods, (n,).

    ``head`` names the output: ``distress`` or ``intents``. Return None if the file has no network
    with this output for the language.
    """
    stored = _stored(file, language)
    if f"{language}_{head}" not in stored:
        return None
    known, vectors = stored[f"{language}_known"], stored[f"{language}_vectors"]
    filters = [stored[f"{language}_filters{width}"] for width in _WIDTHS]  # (width, size, n)
    biases = [stored[f"{language}_bias{width}"] for width in _WIDTHS]
    side_by_side = np.hstack([part for one in filters for part in one])
    pieces = np.split(side_by_side, range(_PIECE, side_by_side.shape[1], _PIECE), axis=1)
    weights, bias = stored[f"{language}_{head}"], stored[f"{language}_{head}_bias"]

    def likelihoods(said: str) -> Likelihoods:
        steps = steps_of(said, language)
        numbers = np.array([number for step in steps for number in step], dtype=np.uint32)
        at = np.repeat(np.arange(len(steps)), [len(step) for step in steps])
        told, place = find(known, numbers)
        rows = np.zeros((len(steps) + 2 * MARGIN, vectors.shape[1]), dtype=np.float32)
        np.add.at(rows, MARGIN + at[told], vectors[place])
        mean = rows.sum(axis=0) / np.sqrt(max(len(steps), 1))
        found = _strongest(np.hstack([rows @ piece for piece in pieces]), biases)
        score = np.einsum("f,fn->n", np.concatenate([*found, mean]), weights)
        return softmax(score.astype(np.float64) + bias)

    return likelihoods


def _strongest(fits: Floats, biases: list[Floats]) -> list[Floats]:
    """Return the strongest response of each filter, as an array (n,) for each filter width.

    ``fits`` has a row for each place in the sentence. For each width it has width × n columns: the
    response of every position in each of the n filters to the words at that place.
    """
    strongest, begin = [], 0
    for width, bias in zip(_WIDTHS, biases, strict=True):
        last, n = len(fits) - width + 1, len(bias)
        parts = (fits[at : at + last, begin + at * n : begin + (at + 1) * n] for at in range(width))
        strongest.append(np.maximum(sum(parts, start=np.float32(0)).max(axis=0) + bias, 0))
        begin += width * n
    return strongest


def _stored(file: Traversable, language: Language) -> dict[str, NDArray[Any]]:
    """Return a language's arrays, with each int8 array multiplied by its scale."""
    with file.open("rb") as opened:
        arrays = np.load(opened)
        mine = {name: arrays[name] for name in arrays.files if name.startswith(f"{language}_")}
    return {
        name: array * np.float32(mine[f"{name}_scale"]) if array.dtype == np.int8 else array
        for name, array in mine.items()
    }
