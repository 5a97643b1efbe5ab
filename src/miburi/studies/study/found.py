"""The findings of a study, in its report and its JSON."""

from dataclasses import dataclass

from miburi.studies.study.exclusions import LeftOut
from miburi.studies.study.kept import Counts, Shown


@dataclass(frozen=True)
class Share:
    """Hits, out of a number of answers."""

    hits: int
    of: int
    #: The 95 % interval of the share, clustered by participant; None for fewer than two people.
    low: float | None
    high: float | None
    #: The share that guessing gives: the same people's answers, dealt to their films at random.
    chance: float | None
    #: The probability of at least as many hits by guessing, corrected for the number of rows in its
    #: table. ``p`` and ``chance`` are None if nobody answered; see :func:`.statistics.by_guessing`.
    p: float | None

    @property
    def value(self) -> float:
        """The share; 0 if there are no answers."""
        return self.hits / self.of if self.of else 0.0


@dataclass(frozen=True)
class ChoiceFindings:
    """The findings of a question with a choice."""

    question: str
    labels: tuple[str, ...]  #: rows and columns of ``confusion``
    confusion: tuple[tuple[int, ...], ...]  #: intended (row) and chosen (column)
    right: Share  #: the share of answers that name the intended feeling
    by_feeling: dict[str, Share]
    by_mood: dict[str, Share]
    by_face: dict[str, Share]
    unbiased: dict[str, float | None]  #: Wagner's hit rate (1993) of each feeling that was shown
    kappa: float | None  #: Cohen's, of chosen against intended feelings, over all answers
    fleiss: float | None  #: among participants who finished and saw every film equally often


@dataclass(frozen=True)
class MeanRating:
    """A mean rating: how many answers, their standard deviation, and the clustered 95 % interval.

    A figure is None if there are too few answers, or too few people.
    """

    answers: int
    mean: float | None
    sd: float | None
    low: float | None
    high: float | None


@dataclass(frozen=True)
class PairOrder:
    """Pairs of films that show one feeling to one person, and how many are in the moods' order.

    ``low`` and ``high`` are the share's 95 % interval, clustered by participant.
    """

    right: float
    pairs: int
    low: float | None
    high: float | None

    @property
    def share(self) -> float | None:
        """The share of pairs in the right order (0.5 by guessing); None if there are no pairs."""
        return self.right / self.pairs if self.pairs else None


@dataclass(frozen=True)
class RatingFindings:
    """The findings of a question with a rating; the value of an answer is the mean of its items.

    Items in ``turned`` are reversed: a value given for one of them becomes points + 1 - value.
    ``means`` (by feeling and mood) and ``order`` are empty if the question is about all films.
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
    """The words in answers, the most frequent first, for each feeling or for all films together."""

    question: str
    words: dict[str, list[tuple[str, int]]]


@dataclass(frozen=True)
class PersonFindings:
    """What people said about themselves: how many gave each answer, or the quartiles of numbers.

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
    seconds: tuple[float, float, float] | None  #: time for a page about a film, quartiles, in s
    #: How many films were never started in a browser that runs scripts, by participants who are not
    #: left out.
    unplayed: int
    shown: Shown  #: how often live gestures were seen
    people: tuple[PersonFindings, ...]
    choices: tuple[ChoiceFindings, ...]
    ratings: tuple[RatingFindings, ...]
    words: tuple[WordFindings, ...]
