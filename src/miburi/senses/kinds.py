"""The kinds of distress, by name."""

from typing import Literal, TypeVar, get_args

#: The kinds of distress. If patterns alone decide, and those of several kinds fit a sentence, the
#: first of these kinds is taken.
Distress = Literal[
    "suicide", "child", "breathing", "heart", "stroke", "poison", "fire", "gas", "abuse", "fraud",
    "lost", "fall", "injury", "help",
]  # fmt: skip
KINDS: tuple[Distress, ...] = get_args(Distress)

_Value = TypeVar("_Value")


def check_kinds(table: dict[Distress, _Value]) -> dict[Distress, _Value]:
    """Return a table by kinds of distress; ValueError if a kind is missing."""
    if missing := [kind for kind in KINDS if kind not in table]:
        raise ValueError(f"{', '.join(map(repr, missing))} is missing; add it")
    return table
