"""Impressions: what every sense returns, and how the partner reacts to them.

A sense is a function from what somebody did (words, a sound, a face, a touch) to an
:class:`Impression`: the feeling that it showed, how strongly, and why. The temperament's table
``empathy`` turns an impression into stimuli for the partner. No sense knows the body.
"""

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from miburi.errors import InputError
from miburi.feelings import FEELINGS, SOURCES, Stimulus, Temperament
from miburi.senses.kinds import Distress

_TOPICS = {
    "asked": "a question about its own feelings",
    "unknown": "words of an unknown language",
    None: "nothing clear",
}


@dataclass(frozen=True)
class Brought:
    """One piece of evidence for a feeling."""

    what: Annotated[str, Field(description="The evidence, such as a word of the sentence.")]
    weight: Annotated[
        float,
        Field(
            description="Log-odds that it adds for the feeling against none; 0 for "
            "words of distress."
        ),
    ]


@dataclass(frozen=True)
class Impression:
    """What a person showed: at most one feeling, with the evidence for it, or distress.

    Parameters
    ----------
    feeling
        Their feeling, one of ``FEELINGS``; None if they showed nothing clear.
    strength
        From 0 to 1; it is 0 if there is no feeling.
    source
        One of ``SOURCES``.
    why
        The evidence for the feeling, the strongest first.
    topic
        A topic that decides the answer, whatever feeling was shown: ``asked`` for questions about
        the partner's feelings, ``unknown`` for words of no language that it knows.
    distress
        The kind of distress in which they need help now, if any. If there is one, no feeling is
        looked for.
    worry
        Possible distress. The partner asks about it, and no feeling is looked for.
    hint
        A slight sign of distress. The partner asks about it if another sign came shortly before.

    Raises
    ------
    InputError
        A name is unknown or the strength is outside [0, 1].
    """

    feeling: str | None
    strength: float
    source: str
    why: tuple[Brought, ...] = ()
    topic: Literal["asked", "unknown"] | None = None
    distress: Distress | None = None
    worry: Distress | None = None
    hint: Distress | None = None

    def __post_init__(self) -> None:
        if self.feeling is not None:
            Stimulus(self.feeling, self.strength, self.source)  # which checks all three
        elif self.source not in SOURCES or not 0 <= self.strength <= 1:
            raise InputError(
                f"source must be one of {', '.join(SOURCES)} and strength a number from 0 to 1, "
                f"got {self.source!r} and {self.strength!r}."
            )

    @property
    def reason(self) -> str:
        """The impression in words, such as "'lovely' and 'thank': happiness 0.80"."""
        *most, last = [f"'{part.what}'" for part in self.why] or [_TOPICS[self.topic]]
        parts = f"{', '.join(most)} and {last}" if most else last
        if self.distress is not None:
            return (f"{parts}: " if self.why else "") + f"distress ({self.distress})"
        if self.worry is not None:
            return f"perhaps distress ({self.worry})"
        return parts if self.feeling is None else f"{parts}: {self.feeling} {self.strength:.2f}"


def stimuli(impression: Impression, temperament: Temperament) -> tuple[Stimulus, ...]:
    """Return the stimuli, if any, that an impression causes in a partner.

    A feeling without a row in the temperament's ``empathy`` is contagious: the partner gets the
    same feeling with the same strength (Section 4: "when speaking to a happy user, the robot will
    automatically get a happy emotion"). If the temperament has a row for the feeling, the row lists
    the partner's feelings, each with a share of the strength.
    """
    if impression.feeling is None:
        return ()
    row = temperament.empathy.get(impression.feeling, {impression.feeling: 1.0})
    return tuple(
        Stimulus(feeling, share * impression.strength, impression.source)
        for feeling in FEELINGS
        if (share := row.get(feeling, 0.0)) > 0
    )
