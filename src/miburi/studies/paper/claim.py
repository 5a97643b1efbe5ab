"""A sentence of the paper, and the result of testing it."""

from dataclasses import dataclass
from enum import StrEnum

__all__ = ["Claim", "ClaimVerdict", "holds"]


class ClaimVerdict(StrEnum):
    """What a run says about a sentence."""

    HOLDS = "holds"
    HOLDS_IF = "holds with a condition"
    DIFFERS = "differs"
    UNKNOWN = "cannot be known here"


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper, and what a run says about it.

    Attributes
    ----------
    section
        The section of the paper in which the sentence stands.
    sentence
        The claim; text in quotation marks is the paper's own.
    verdict
        The run's answer.
    number
        The figures behind the verdict.
    ours
        Our assumptions behind it; empty if there are none.
    """

    section: str
    sentence: str
    verdict: ClaimVerdict
    number: str
    ours: str = ""


def holds(condition: object, otherwise: ClaimVerdict = ClaimVerdict.DIFFERS) -> ClaimVerdict:
    """Return *holds* if the condition is true, else the other verdict."""
    return ClaimVerdict.HOLDS if condition else otherwise
