"""The findings of a study, as they appear in its report and its JSON."""

from dataclasses import dataclass

from miburi.studies.study.exclusions import LeftOut
from miburi.studies.study.store import Counts, Shown


@dataclass(frozen=True)
class Share:
    """Hits, out of a number of answers."""

    hits: int
    of: int
    #: The 95 % interval of the share, clustered by participant; None for fewer than two people.
    low: float | None
    high: float | None
    #: The exact probability of at least as many hits by guessing; None if nobody answered.
    p: float | None

    @property
    def value(self) -> float:
        """The share; 0 if there are no answers."""
        return self.hits / self.of if self.of else 0.0


@dataclass(frozen=True)
class ChoiceFindings:
    """The choices that people made."""

    question: str
    labels: tuple[str, ...]  #: rows and columns of ``confusion``
    confusion: tuple[tuple[int, ...], ...]  #: intended (row) and chosen (column)
    right: Share  #: the share of answers that name the intended feeling
    by_feeling: dict[str, Share]
    by_mood: dict[str, Share]
    by_face: dict[str, Share]
    chance: float  #: the share that guessing gives
    unbiased: dict[str, float | None]  #: Wagner's hit rate (1993) of each feeling that was shown
    kappa: float | None  #: Cohen's, of the choice against the intended feeling; over all answers
    fleiss: float | None  #: among those who saw every film equally often and finished


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
    """All findings of a study."""

    counts: Counts  #: how many people took part
    left_out: tuple[LeftOut, ...]  #: participants left out of all figures below
    wordings: tuple[int, ...]  #: the first participant to see each change of the study's words
    seconds: tuple[float, float, float] | None  #: s for a page about a film, the quartiles
    shown: Shown  #: how often live gestures were seen
    people: tuple[PersonFindings, ...]
    choices: tuple[ChoiceFindings, ...]
    ratings: tuple[RatingFindings, ...]
    words: tuple[WordFindings, ...]
