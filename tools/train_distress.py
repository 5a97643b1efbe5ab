"""Train the linear model of distress: written sentences in, one small file out.

    python tools/train_distress.py [--out src/miburi/senses/distress.npz]

Needs SciPy (the extra ``studies``). The sentences are drawn from ``distress-lessons.toml`` beside
this script, all written by one of Miburi's authors, and from ``distress-lines`` beside it, which
twenty-five strangers wrote. The model is a multinomial logistic regression on groups of words and
letters (:func:`miburi.senses.distress.features`), its weights rounded to eight bits. The patterns
that fit count as groups, too: train again after a change of a ``distress.toml``. The same sentences
give the same verdicts; the file's last bits depend on the versions of NumPy and SciPy.
"""

import argparse
import re
import tomllib
from pathlib import Path

import numpy as np
from scipy.optimize import minimize
from scipy.sparse import csr_matrix

from miburi.languages import Language, plain
from miburi.senses.distress import features
from miburi.senses.kinds import KINDS

ROOT = Path(__file__).parents[1]
LESSONS = Path(__file__).with_name("distress-lessons.toml")
STRANGERS = Path(__file__).with_name("distress-lines")
DRAWN = 48  # sentences from a line, at most
SEED = 31
AT_LEAST = 2  # sentences that a group must stand in
C = 20.0  # 1 / strength of the penalty on large weights
KEPT = 20_000  # groups with the largest weights, by language
_CHOICE = re.compile(r"\(([^()]*)\)")


def draw(line: str, random: np.random.Generator) -> str:
    """Return one sentence of a line of choices."""
    while found := _CHOICE.search(line):
        options = found.group(1).split("|")
        chosen = options[int(random.integers(len(options)))]
        line = line[: found.start()] + chosen + line[found.end() :]
    return line


def sentences(language: Language) -> list[tuple[int, str]]:
    """Return plain sentences, each once, by label; no distress is the last one."""
    random = np.random.default_rng(SEED)
    lessons = tomllib.loads(LESSONS.read_text(encoding="utf-8"))[language]
    rows = {}
    for label, kind in enumerate((*KINDS, "none")):
        for line in lessons[kind]:
            for _ in range(DRAWN):
                rows[plain(draw(line, random), language)] = label
    if language == "en":
        for text in everyday():
            rows.setdefault(plain(text, language), len(KINDS))
    for label, text in strangers(language):
        rows[plain(text, language)] = label
    return [(label, text) for text, label in rows.items()]


def strangers(language: Language) -> list[tuple[int, str]]:
    """Return what strangers wrote, by label; their signs for everyday lines and stories are one."""
    labels = {kind: label for label, kind in enumerate(KINDS)}
    files = sorted(STRANGERS.glob(f"{language}-*.tsv"))
    rows = [row.split("\t") for file in files for row in file.read_text("utf-8").splitlines()]
    return [(labels.get(kind, len(KINDS)), text) for kind, text in rows]


def everyday() -> list[str]:
    """Return what somebody says who only feels something, from the lessons of the words sense."""
    lessons = tomllib.loads(LESSONS.with_name("words-lessons.toml").read_text(encoding="utf-8"))
    alarms = ("fright", "fear")
    plain_ones = [one for name, one in lessons.items() if name not in alarms]
    said = [text for one in plain_ones for text in one["says"]]
    said += [f"I am {state}" for one in plain_ones for state in one.get("state", [])]
    for file in sorted(LESSONS.with_name("words-lines").glob("*.tsv")):
        rows = (row.split("\t") for row in file.read_text("utf-8").splitlines())
        said += [text for name, text in rows if name not in alarms]
    return said


def train(language: Language) -> dict[str, np.ndarray]:
    """Return a language's keys, weights, their scale, and biases."""
    rows = sentences(language)
    groups = [features(text, language) for _, text in rows]
    known, count = np.unique(np.concatenate([np.array(g) for g in groups]), return_counts=True)
    known = known[count >= AT_LEAST]
    told = set(known.tolist())
    place = [np.searchsorted(known, [n for n in g if n in told]) for g in groups]
    values = [np.full(len(p), 1 / np.sqrt(len(g))) for p, g in zip(place, groups, strict=True)]
    ends = np.concatenate([[0], np.cumsum([len(p) for p in place])])
    x = csr_matrix((np.concatenate(values), np.concatenate(place), ends), (len(rows), len(known)))
    y = np.eye(len(KINDS) + 1)[[label for label, _ in rows]]
    share = np.where(y[:, -1] > 0, 1 / y[:, -1].sum(), 1 / y[:, :-1].sum()) * len(rows) / 2
    size = (len(known), y.shape[1])

    def loss(flat: np.ndarray) -> tuple[float, np.ndarray]:
        w, b = flat[: -size[1]].reshape(size), flat[-size[1] :]
        score = x @ w + b
        score -= score.max(axis=1, keepdims=True)
        log_p = score - np.log(np.exp(score).sum(axis=1, keepdims=True))
        wrong = share[:, None] * (np.exp(log_p) - y)
        value = -(share[:, None] * y * log_p).sum() + (w**2).sum() / 2 / C
        return float(value), np.concatenate([(x.T @ wrong + w / C).ravel(), wrong.sum(axis=0)])

    found = minimize(loss, np.zeros(size[0] * size[1] + size[1]), jac=True, method="L-BFGS-B",
                     options={"maxiter": 150}).x  # fmt: skip
    w, b = found[: -size[1]].reshape(size), found[-size[1] :]
    kept = np.sort(np.argsort(-np.abs(w).max(axis=1))[:KEPT])
    w = w[kept]
    scale = np.abs(w).max() / 127
    print(f"{language}: {len(rows)} sentences, {len(known)} groups, {len(kept)} kept")
    return {
        f"{language}_keys": known[kept].astype(np.uint32),
        f"{language}_weights": np.round(w / scale).astype(np.int8),
        f"{language}_scale": np.float64(scale),
        f"{language}_bias": b,
    }


def main() -> None:
    """Train both languages and write the file."""
    parser = argparse.ArgumentParser(description="Train the linear model of distress.")
    parser.add_argument(
        "--out", type=Path, default=ROOT / "src" / "miburi" / "senses" / "distress.npz"
    )
    wish = parser.parse_args()
    arrays = train("en") | train("ja")
    np.savez_compressed(wish.out, allow_pickle=False, **arrays)
    print(f"{wish.out}: {wish.out.stat().st_size} bytes")


if __name__ == "__main__":
    main()
