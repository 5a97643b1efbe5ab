"""Train a linear model of words: a multinomial logistic regression on groups of words and letters.

Needs SciPy (the extra ``studies``). ``miburi.senses.linear`` reads what it makes.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.optimize import minimize
from scipy.sparse import csr_matrix

AT_LEAST = 2  # sentences that a group must stand in
C = 20.0  # 1 / strength of the penalty on large weights

LANGUAGES = ("en", "ja")  # that have models

Model = dict[str, np.ndarray]


def fit(
    groups: list[list[int]],
    labels: np.ndarray,
    share: np.ndarray,
    language: str,
    *,
    kept: int,
    c: float = C,
) -> Model:
    """Return a language's keys, weights, their scale, and biases.

    Of n sentences: ``groups`` has the numbers of each, ``labels``, (n,), what it means, and
    ``share``, (n,), how much it weighs. The ``kept`` groups with the largest weights stay. ``c`` is
    1 / strength of the penalty on large weights.
    """
    known, count = np.unique(np.concatenate([np.array(g) for g in groups]), return_counts=True)
    known = known[count >= AT_LEAST]
    told = set(known.tolist())
    place = [np.searchsorted(known, [n for n in g if n in told]) for g in groups]
    values = [np.full(len(p), 1 / np.sqrt(len(g))) for p, g in zip(place, groups, strict=True)]
    ends = np.concatenate([[0], np.cumsum([len(p) for p in place])])
    size = (len(groups), len(known))
    x = csr_matrix((np.concatenate(values), np.concatenate(place), ends), size)
    y = np.eye(labels.max() + 1)[labels]
    shape = (len(known), y.shape[1])

    def loss(flat: np.ndarray) -> tuple[float, np.ndarray]:
        w, b = flat[: -shape[1]].reshape(shape), flat[-shape[1] :]
        score = x @ w + b
        score -= score.max(axis=1, keepdims=True)
        log_p = score - np.log(np.exp(score).sum(axis=1, keepdims=True))
        wrong = share[:, None] * (np.exp(log_p) - y)
        value = -(share[:, None] * y * log_p).sum() + (w**2).sum() / 2 / c
        return float(value), np.concatenate([(x.T @ wrong + w / c).ravel(), wrong.sum(axis=0)])

    begin = np.zeros(shape[0] * shape[1] + shape[1])
    found = minimize(loss, begin, jac=True, method="L-BFGS-B", options={"maxiter": 150}).x
    w, b = found[: -shape[1]].reshape(shape), found[-shape[1] :]
    stays = np.sort(np.argsort(-np.abs(w).max(axis=1))[:kept])
    w = w[stays]
    scale = np.abs(w).max() / 127
    print(f"{language}: {len(groups)} sentences, {len(known)} groups, {len(stays)} kept")
    return {
        f"{language}_keys": known[stays].astype(np.uint32),
        f"{language}_weights": np.round(w / scale).astype(np.int8),
        f"{language}_scale": np.float64(scale),
        f"{language}_bias": b,
    }


def save(file: Path, train: Callable[[str], Model], only: str | None = None) -> None:
    """Train each language and write the file; with ``only``, the other languages stay in it."""
    arrays: Model = dict(np.load(file)) if only and file.exists() else {}
    for language in [only] if only else LANGUAGES:
        arrays = {k: v for k, v in arrays.items() if not k.startswith(f"{language}_")}
        arrays |= train(language)
    np.savez_compressed(file, allow_pickle=False, **arrays)
    print(f"{file}: {file.stat().st_size} bytes")
