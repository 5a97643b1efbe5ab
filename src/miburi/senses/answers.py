"""Small answers: what the partner says to what it heard.

In go an impression of somebody's words and the partner's own feeling; out comes a short sentence,
chosen with the partner's seed, and never the same twice running. The sentences are
``answers-en.toml`` and ``answers-ja.toml``, beside this module.
"""

import tomllib
from functools import cache
from importlib import resources
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, RootModel, model_validator

from miburi.feelings import Expression
from miburi.feelings.catalogue import FeelingName
from miburi.senses.impression import Impression
from miburi.senses.language import Language

__all__ = ["Answerer", "Answers", "shipped_answers"]

_Lines = Annotated[list[Annotated[str, Field(min_length=1, max_length=120)]], Field(min_length=2)]


class Answers(
    RootModel[
        dict[
            FeelingName | Literal["none", "any", "asked"],
            dict[FeelingName | Literal["any"], _Lines],
        ]
    ]
):
    """Sentences by what was heard, then by what the partner feels."""

    @model_validator(mode="after")
    def _check_complete(self) -> Self:
        missing = [name for name in ("none", "any", "asked") if name not in self.root]
        missing += [f"{heard}.any" for heard, row in self.root.items() if "any" not in row]
        if missing:
            raise ValueError(f"{', '.join(missing)} is missing; it answers what has no other row")
        for heard, row in self.root.items():
            for felt, lines in row.items():
                if len(set(lines)) < len(lines):
                    raise ValueError(f"{heard}.{felt} has a sentence twice; keep one")
        return self

    def lines(self, heard: str | None, felt: str | None) -> list[str]:
        """Return the sentences for a feeling that was heard and one that is felt, each or none."""
        row = self.root.get(heard or "none", self.root["any"])
        return row.get(felt or "any", row["any"])


@cache
def shipped_answers(language: Language) -> Answers:
    """Return the answers of a language; they are read once."""
    file = resources.files(__package__) / f"answers-{language}.toml"
    return Answers.model_validate(tomllib.loads(file.read_text(encoding="utf-8")))


class Answerer:
    """Chooses answers.

    Parameters
    ----------
    seed
        Chooses among the sentences: the same talk gets the same answers.
    """

    def __init__(self, seed: int = 0) -> None:
        self._random = np.random.default_rng(seed)
        self._last = ""

    def answer(self, heard: Impression, own: Expression | None, answers: Answers) -> str:
        """Return what a partner that feels something of its own, or nothing, answers."""
        felt = None if own is None else own.feeling
        row = answers.lines(heard.topic or heard.feeling, felt)
        lines = [line for line in row if line != self._last]
        self._last = lines[int(self._random.integers(len(lines)))]
        return self._last
