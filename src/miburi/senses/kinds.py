"""The kinds of distress, by name."""

from typing import Literal, get_args

#: The kinds of distress; where patterns alone decide and several fit, the first here is taken.
Distress = Literal[
    "suicide", "child", "breathing", "heart", "stroke", "poison", "fire", "gas", "abuse", "fraud",
    "lost", "fall", "injury", "help",
]  # fmt: skip
KINDS: tuple[Distress, ...] = get_args(Distress)
