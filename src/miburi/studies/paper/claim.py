"""A sentence of the paper, and the result of testing it."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from miburi.studies.paper.runs import Runs


class ClaimVerdict(StrEnum):
    """The result of testing a sentence."""

    HOLDS = "holds"
    HOLDS_IF = "holds with a condition"
    DIFFERS = "differs"
    UNKNOWN = "cannot be known here"


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper, and the result of its test.

    ``sentence`` has the paper's own words in quotation marks, ``number`` the figures behind the
    verdict, and ``ours`` our assumptions, if any.
    """

    section: str
    sentence: str
    verdict: ClaimVerdict
    number: str
    ours: str = ""


#: A verdict and its number.
Finding = tuple[ClaimVerdict, str]
#: The function that tests each claim, by the claim's name, in the paper's order.
Claims = dict[str, Callable[[Runs], Claim]]


def claim(
    claims: Claims, section: str, sentence: str, ours: str = ""
) -> Callable[[Callable[[Runs], Finding]], None]:
    """Add the decorated function to ``claims``, as the test of a sentence."""

    def add(test: Callable[[Runs], Finding]) -> None:
        def carry_out(runs: Runs) -> Claim:
            verdict, number = test(runs)
            assumed = "" if verdict is ClaimVerdict.UNKNOWN else ours
            return Claim(section, sentence, verdict, number, assumed)

        claims[test.__name__.strip("_").replace("_", "-")] = carry_out

    return add


def holds(condition: object, weaker: object = False) -> ClaimVerdict:
    """Return a verdict: holds, holds with a condition (if only ``weaker`` is true), or differs."""
    if condition:
        return ClaimVerdict.HOLDS
    return ClaimVerdict.HOLDS_IF if weaker else ClaimVerdict.DIFFERS
