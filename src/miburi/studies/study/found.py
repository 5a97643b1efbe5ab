"""The findings of a study, as they appear in its report and its JSON."""

from dataclasses import dataclass

from miburi.studies.study.exclusions import LeftOut
from miburi.studies.study.store import Counts, Shown

__all__ = [
    "ChoiceFindings",
    "Findings",
    "MeanRating",
    "PairOrder",
    "PersonFindings",
    "RatingFindings",
    "Share",
    "WordFindings",
]


@dataclass(frozen=True)
class Share:
    """Hits, out of a number of answers.

    Attributes
    ----------
    hits, of
        The number of hits, and the number of answers.
    low, high
        The 95 % interval of the share, clustered by participant; None for fewer than two people.
    p
        The exact probability of at least as many hits by guessing; None if nobody answered.
    """

    hits: int
    of: int
    low: float | None
    high: float | None
    p: float | None

    @property
    def value(self) -> float:
        """The share; 0 if there are no answers."""
        return self.hits / self.of if self.of else 0.0


@dataclass(frozen=True)
class ChoiceFindings:
    """What people chose.

    Attributes
    ----------
    question
        The question's name.
    labels
        Rows and columns of ``confusion``: intended (row) and chosen (column).
    right
        The share of answers that name the intended feeling; ``by_feeling``, ``by_mood`` and
        ``by_face`` break it down.
    chance
        The share that guessing gives.
    unbiased
        Wagner's unbiased hit rate (1993) of each feeling that was shown.
    kappa
        Cohen's, of the choice against the intended feeling; over all answers.
    fleiss
        Fleiss's, among those who saw every film equally often and finished.
    """

    question: str
    labels: tuple[str, ...]
    confusion: tuple[tuple[int, ...], ...]
    right: Share
    by_feeling: dict[str, Share]
    by_mood: dict[str, Share]
    by_face: dict[str, Share]
    chance: float
    unbiased: dict[str, float | None]
    kappa: float | None
    fleiss: float | None


@dataclass(frozen=True)
class MeanRating:
    """A mean rating: how many answers, their standard deviation, and the clustered 95 % interval.

    None where there are too few answers, or people.
    """

    answers: int
    mean: float | None
    sd: float | None
    low: float | None
    high: float | None


@dataclass(frozen=True)
class PairOrder:
    """The pairs of films of one feeling and person, and how many have ratings in the moods' order.

    ``low`` and ``high`` are the share's 95 % interval, clustered by participant.
    """

    right: float
    pairs: int
    low: float | None
    high: float | None

    @property
    def share(self) -> float | None:
        """The share; guessing gives 0.5; None if there is no pair."""
        return self.right / self.pairs if self.pairs else None


@dataclass(frozen=True)
class RatingFindings:
    """How people rated; the value of an answer is the mean of its items.

    Items in ``turned`` are reversed: their values here are points + 1 - value. ``means`` (by
    feeling and mood) and ``order`` are empty where a question is about all films.
    """

    question: str
    points: int
    all: MeanRating
    items: dict[str, MeanRating]
    turned: tuple[str, ...]
    alpha: float | None
    means: dict[str, dict[str, MeanRating]]
    order: PairOrder
    by_feeling: dict[str, PairOrder]


@dataclass(frozen=True)
class WordFindings:
    """The words that people wrote, the most frequent first, by feeling or about all films."""

    question: str
    words: dict[str, list[tuple[str, int]]]


@dataclass(frozen=True)
class PersonFindings:
    """What people said of themselves: how many gave each answer, or the numbers' quartiles.

    ``silent`` is how many would rather not say.
    """

    question: str
    counts: dict[str, int]
    quartiles: tuple[float, float, float] | None
    silent: int


@dataclass(frozen=True)
class Findings:
    """All findings of a study.

    Attributes
    ----------
    counts
        How many people took part.
    left_out
        The participants who are left out of all figures below, with the reasons.
    wordings
        For each change of the study's wording, the first participant who saw the new words.
    seconds
        How long a page about a film took, s: the quartiles; None if that was not recorded.
    shown
        How often live gestures were seen.
    """

    counts: Counts
    left_out: tuple[LeftOut, ...]
    wordings: tuple[int, ...]
    seconds: tuple[float, float, float] | None
    shown: Shown
    people: tuple[PersonFindings, ...]
    choices: tuple[ChoiceFindings, ...]
    ratings: tuple[RatingFindings, ...]
    words: tuple[WordFindings, ...]
