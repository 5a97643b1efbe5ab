"""The kinds of distress, by name."""

from typing import Literal, get_args

#: The kinds of distress. If patterns alone decide, and those of several kinds fit a sentence, the
#: first of these kinds is taken.
Distress = Literal[
    "suicide", "child", "breathing", "heart", "stroke", "poison", "fire", "gas", "abuse", "fraud",
    "lost", "fall", "injury", "help",
]  # fmt: skip
KINDS: tuple[Distress, ...] = get_args(Distress)
