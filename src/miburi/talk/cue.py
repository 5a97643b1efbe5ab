"""A cue with its answers, and the answers to a feeling."""

from collections.abc import Container
from functools import cached_property
from typing import Annotated, Literal, NamedTuple, Self

from pydantic import AfterValidator, Field, RootModel, model_validator

from miburi.feelings.catalogue import FeelingName
from miburi.ground.placeholders import filled_with, placeholders
from miburi.ground.tables import Table
from miburi.talk.moves import MOVES

#: The acts, other than movements and tunes, that can accompany an answer.
Do = Literal["stop", "repeat", "name", "remember", "amend", "recall", "forget"]


#: What an answer may mention; a sentence is left out while one of its slots is empty.
_NAMES = """clock date tomorrow name it words told surely before next last day away ahead sum kept
latest lately corrected stopped"""
_SLOTS = dict.fromkeys(_NAMES.split(), "…")

_Said = Annotated[str, Field(min_length=1, max_length=160)]
#: A sentence that can be said.
Line = Annotated[_Said, AfterValidator(filled_with(**_SLOTS))]
Lines = Annotated[list[Line], Field(min_length=2)]
#: Sentences at the beginning of a talk, and those that mention nothing.
Openings = Annotated[
    list[Annotated[_Said, AfterValidator(filled_with(name="…", told="…"))]], Field(min_length=2)
]
PlainLines = Annotated[list[Annotated[_Said, AfterValidator(filled_with())]], Field(min_length=2)]


class Cue(Table):
    """Something that people say, and the answers to it; ``talk.toml`` shows how they are written.

    Attributes
    ----------
    name, when
        The intent or topic, such as ``greeting``, and regular expressions over a sentence's plain
        words; the group ``it`` captures the subject. Without any, only :mod:`miburi.talk.asking`
        finds the cue.
    say, echo
        Answers, with slots such as ``{it}``; whether the partner first repeats the question,
        because the answer is a general one.
    do, move, show, look, tune
        The act that comes with the answer: one of ``Do``, a move of ``moves.toml``, the gesture of
        a feeling, a direction to look in, or [Hz, s] notes that a page plays instead of the words.
    stays
        The number of turns for which words may refer to this cue. If it is 1, a question that
        matches the script's ``again`` refers to this cue, unless the question asks for an act. If
        it is more than 1, words that match the script's ``more`` refer to this cue.
    broad, aside
        Whether :mod:`miburi.talk.asking` may overrule its broad patterns; whether a question or a
        request in another sentence takes priority.
    light, heavy
        Whether a wrong match would be out of place, so that the model must be surer than elsewhere,
        and ``heavy`` words rule the cue out. Whether a topic is taken up even after a greeting or
        thanks.
    mine, capital
        Whether this topic needs words about the speaker; and whether its subject must begin with a
        capital letter.
    wish
        Whether it can be requested without a question ("Keep me company"), although it triggers no
        movement. A wrong match would do no harm.
    without, within
        Names of a slot that must be empty, and of one that must be filled. Once the speaker's name
        is known, "it is Toby" does not change it; "I do not get it" is about a joke only after a
        joke (``after_joke``).
    own
        Whether the partner answers this itself even if a language model answers the rest, because a
        model cannot know the answer.
    named, refers
        Regular expression of words that name this cue's act, so that a later "do it" means this
        cue; and whether this cue is itself a "do it".
    """

    name: Annotated[str, Field(pattern=r"^[a-z][a-z_]*$")]
    when: list[str] = Field(default_factory=list)
    say: Annotated[list[Line], Field(min_length=1)]
    do: Do | None = None
    move: Annotated[str, Field(pattern=f"^({'|'.join(MOVES)})$")] | None = None
    show: FeelingName | None = None
    look: Literal["user", "left", "right", "up", "down", "aside"] | None = None
    stays: Annotated[int, Field(ge=0, le=9)] = 0
    broad: bool = False
    echo: bool = False
    light: bool = False
    wish: bool = False
    aside: bool = False
    capital: bool = False
    heavy: bool = False
    mine: bool = False
    own: bool = False
    named: str | None = None
    refers: bool = False
    without: str | None = None
    within: str | None = None
    tune: list[Annotated[list[float], Field(min_length=2, max_length=2)]] | None = None

    @model_validator(mode="after")
    def _check_subject(self) -> Self:
        about = [line for line in self.say if {"it", "words"} & slots_in(line)]
        if about and not any("(?P<it>" in pattern for pattern in self.when):
            raise ValueError(
                f"{about[0]!r} needs a subject: no pattern in `when` has a group (?P<it>…)"
            )
        return self

    @property
    def acts(self) -> bool:
        """Whether an act accompanies the words."""
        return bool(self.do or self.shows)

    @cached_property
    def shows(self) -> bool:
        """Whether the cue produces a movement, a look or a tune."""
        return bool(self.move or self.show or self.look or self.tune)

    @cached_property
    def orders(self) -> bool:
        """Whether the cue asks for a visible or audible act, or for fun that can be repeated."""
        return self.shows or self.stays > 1

    @cached_property
    def brief(self) -> bool:
        """Whether the cue may match a single clause of a sentence."""
        return self.shows or self.do == "recall"

    def fits(self, filled: Container[str]) -> bool:
        """Return whether ``without`` and ``within`` allow this cue when these slots are filled."""
        return self.without not in filled and (self.within is None or self.within in filled)


def slots_in(line: str) -> set[str]:
    """Return the names of a sentence's slots."""
    return {name.strip("{}") for name in placeholders(line)}


class Match(NamedTuple):
    """A cue that matched, with its subject in the speaker's words and in the partner's."""

    cue: Cue
    words: str | None
    it: str | None


class Answers(
    RootModel[
        dict[
            FeelingName | Literal["none", "any", "asked"],
            dict[FeelingName | Literal["any"], Lines],
        ]
    ]
):
    """Sentences by the feeling that was heard, then by the partner's own feeling."""

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
        """Return the sentences for the feelings ``heard`` and ``felt``; either may be None."""
        row = self.root.get(heard or "none", self.root["any"])
        return row.get(felt or "any", row["any"])
