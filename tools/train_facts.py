"""Train the linear model of what tells a fact about somebody's life: lines in, one small file out.

    python tools/train_facts.py [--out src/miburi/talk/facts.npz] [--check]

Needs SciPy (the extra ``studies``). The lines are those of ``fact-lines`` beside this script, each
with what it tells: ``fact``, or ``none``. Each file is by another stranger, who knew nothing of
Miburi. ``--check`` leaves out one writer at a time, and judges that writer's lines.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
from linear_model import Model, fit

from miburi.languages import Language, plain
from miburi.senses.linear import groups_of, load_model, numbered

ROOT = Path(__file__).parents[1]
LINES = Path(__file__).with_name("fact-lines")
KEPT = 20_000
Line = tuple[str, str]


def writers(language: Language) -> list[list[Line]]:
    """Return each writer's lines, with what they tell."""
    files = sorted(LINES.glob(f"{language}-*.tsv"))
    rows = [file.read_text(encoding="utf-8").splitlines() for file in files]
    return [[(row.split("\t")[0], row.split("\t")[1]) for row in file] for file in rows]


def train(lines: list[Line], language: Language) -> Model:
    """Return the model; lines with and without a fact weigh the same together."""
    labels = np.array([told == "fact" for told, _ in lines], dtype=int)
    share = 1 / np.bincount(labels)[labels]
    groups = [numbered(groups_of(plain(said, language), language)) for _, said in lines]
    return fit(groups, labels, share / share.mean(), language, kept=KEPT)


def check(language: Language) -> None:
    """Judge each writer's lines by a model that was trained on the others'."""
    each = writers(language)
    for number, judged in enumerate(each):
        others = [line for k, lines in enumerate(each) if k != number for line in lines]
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "facts.npz"
            np.savez_compressed(file, allow_pickle=False, **train(others, language))
            model = load_model(file, language)
        assert model is not None
        likely = [
            model(numbered(groups_of(plain(said, language), language)))[1] for _, said in judged
        ]
        tells = np.array([told == "fact" for told, _ in judged])
        for least in (0.5, 0.6, 0.7):
            taken = np.array(likely) > least
            print(
                f"{language}, writer {number}, above {least}: {(taken & tells).sum()} of "
                f"{tells.sum()} facts; {(taken & ~tells).sum()} of {(~tells).sum()} other lines"
            )


def main() -> None:
    """Train, and write the file or check."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--out", type=Path, default=ROOT / "src/miburi/talk/facts.npz")
    parser.add_argument("--check", action="store_true")
    wish = parser.parse_args()
    if wish.check:
        for language in ("en", "ja"):
            check(language)
        return
    model: Model = {}
    for language in ("en", "ja"):
        model |= train([line for lines in writers(language) for line in lines], language)
    np.savez_compressed(wish.out, allow_pickle=False, **model)
    print(f"{wish.out}: {wish.out.stat().st_size} bytes")


if __name__ == "__main__":
    main()
