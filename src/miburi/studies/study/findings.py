"""From the answers of a study to its findings: numbers that a page and JSON can show."""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

from miburi.studies.study.plan import Film, Question, Study
from miburi.studies.study.statistics import (
    cohen_kappa,
    cronbach_alpha,
    fleiss_kappa,
    right_order,
)
from miburi.studies.study.store import Counts, Shown, StudyAnswer
from miburi.studies.trials.summary import wilson

__all__ = [
    "ChoiceFindings",
    "Findings",
    "PairOrder",
    "RatingFindings",
    "Share",
    "WordFindings",
    "find",
]


@dataclass(frozen=True)
class Share:
    """So many hits of so many, and Wilson's 95 % interval of the share."""

    hits: int
    of: int
    low: float
    high: float

    @property
    def value(self) -> float:
        """The share; 0 of none."""
        return self.hits / self.of if self.of else 0.0


@dataclass(frozen=True)
class ChoiceFindings:
    """What people chose.

    Attributes
    ----------
    question
        Its name.
    labels
        Rows and columns of ``confusion``: intended (row) and chosen (column).
    right
        How often the intended feeling was chosen; ``by_feeling`` of each, and ``by_mood``.
    chance
        The share that guessing gives.
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
    kappa: float | None
    fleiss: float | None


@dataclass(frozen=True)
class PairOrder:
    """So many pairs of one person's films of one feeling have their ratings in the moods' order."""

    right: float
    pairs: int

    @property
    def share(self) -> float | None:
        """The share; guessing gives 0.5; None of no pair."""
        return self.right / self.pairs if self.pairs else None


@dataclass(frozen=True)
class RatingFindings:
    """How people rated; the value of an answer is the mean of its items, reversed ones turned.

    ``means`` by feeling and mood, and ``order``, are empty where the question is about all films.
    """

    question: str
    points: int
    answers: int
    mean: float | None
    items: dict[str, float]
    alpha: float | None
    means: dict[str, dict[str, float]]
    order: PairOrder
    by_feeling: dict[str, PairOrder]


@dataclass(frozen=True)
class WordFindings:
    """The words that people wrote, the most frequent first, by feeling or about all films."""

    question: str
    words: dict[str, list[tuple[str, int]]]


@dataclass(frozen=True)
class Findings:
    """All findings of a study; ``shown`` counts its live gestures."""

    counts: Counts
    shown: Shown
    choices: tuple[ChoiceFindings, ...]
    ratings: tuple[RatingFindings, ...]
    words: tuple[WordFindings, ...]


def find(
    study: Study,
    answers: Sequence[StudyAnswer],
    counts: Counts,
    showings: Mapping[tuple[int, int], Shown],
) -> Findings:
    """Sum up the answers of a study; people who have not finished count as far as they came."""
    films = {film.name: film for film in study.films}
    of = {
        q.name: [answer for answer in answers if answer.question == q.name] for q in study.question
    }
    kinds = {
        kind: [question for question in study.question if question.kind == kind]
        for kind in ("choice", "rating", "word")
    }
    return Findings(
        counts,
        Shown(
            sum(shown.whole for shown in showings.values()),
            sum(shown.broken for shown in showings.values()),
        ),
        tuple(_choices(study, question, of[question.name], films) for question in kinds["choice"]),
        tuple(_ratings(question, of[question.name], films) for question in kinds["rating"]),
        tuple(_words(question, of[question.name], films) for question in kinds["word"]),
    )


def _choices(
    study: Study, question: Question, answers: list[StudyAnswer], films: dict[str, Film]
) -> ChoiceFindings:
    options = study.options(question)
    pairs = [(films[answer.film or ""], answer.value) for answer in answers]
    shown = dict.fromkeys(film.feeling for film in study.films)
    labels = tuple(dict.fromkeys((*options, *shown)))
    count = Counter((film.feeling, value) for film, value in pairs)
    confusion = tuple(tuple(count[row, column] for column in labels) for row in labels)

    def shares(group: Callable[[Film], str], names: Iterable[str]) -> dict[str, Share]:
        return {
            name: _share([film.feeling == value for film, value in pairs if group(film) == name])
            for name in names
        }

    return ChoiceFindings(
        question.name,
        labels,
        confusion,
        _share([film.feeling == value for film, value in pairs]),
        shares(lambda film: film.feeling, shown),
        shares(_mood, sorted({_mood(film) for film in study.films})),
        shares(_face, sorted({_face(film) for film in study.films}, reverse=True)),
        1 / len(options),
        cohen_kappa(confusion),
        _fleiss(study, answers, options),
    )


def _fleiss(study: Study, answers: list[StudyAnswer], options: tuple[str, ...]) -> float | None:
    trials = study.trials or len(study.films)
    each = Counter(answer.participant for answer in answers)
    whole = [answer for answer in answers if each[answer.participant] == trials]
    count = Counter((answer.film, answer.value) for answer in whole)
    return fleiss_kappa([[count[film.name, option] for option in options] for film in study.films])


def _ratings(
    question: Question, answers: list[StudyAnswer], films: dict[str, Film]
) -> RatingFindings:
    pages: dict[tuple[int, int], dict[str, float]] = defaultdict(dict)
    film_of: dict[tuple[int, int], Film | None] = {}
    turned = {item.name for item in question.items if item.reversed}
    for answer in answers:
        page = (answer.participant, answer.step)
        value = float(answer.value)
        pages[page][answer.item] = question.points + 1 - value if answer.item in turned else value
        film_of[page] = films[answer.film] if answer.film is not None else None
    names = [item.name for item in question.items]
    table = [[page[name] for name in names] for page in pages.values()]
    value_of = {page: _mean(list(values.values())) for page, values in pages.items()}
    cells: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    # Pairs are one person's, of one feeling, with or without the face, or live.
    groups: dict[tuple[int, str, str], list[tuple[float, float]]] = defaultdict(list)
    for page, film in film_of.items():
        if film is not None:
            cells[film.feeling][_mood(film)].append(value_of[page])
            groups[page[0], film.feeling, _face(film)].append((film.mood, value_of[page]))
    orders: dict[str, list[tuple[float, int]]] = defaultdict(list)
    for (_, feeling, _), pairs in groups.items():
        moods, ratings = zip(*pairs, strict=True)
        orders[feeling].append(right_order(moods, ratings))
    return RatingFindings(
        question.name,
        question.points,
        len(table),
        _mean(list(value_of.values())) if table else None,
        {name: _mean([row[k] for row in table]) for k, name in enumerate(names) if table},
        cronbach_alpha(table),
        {
            feeling: {mood: _mean(values) for mood, values in sorted(row.items())}
            for feeling, row in sorted(cells.items())
        },
        _sum([order for each in orders.values() for order in each]),
        {feeling: _sum(each) for feeling, each in sorted(orders.items())},
    )


def _words(question: Question, answers: list[StudyAnswer], films: dict[str, Film]) -> WordFindings:
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    for answer in answers:
        about = films[answer.film].feeling if answer.film is not None else ""
        counts[about][answer.value.casefold()] += 1
    # The same number: in the order of the alphabet, so that the same answers give the same page.
    return WordFindings(
        question.name,
        {
            about: sorted(count.items(), key=lambda pair: (-pair[1], pair[0]))
            for about, count in sorted(counts.items())
        },
    )


def _share(right: list[bool]) -> Share:
    hits = sum(right)
    low, high = wilson(hits, len(right))
    return Share(hits, len(right), low, high)


def _sum(orders: list[tuple[float, int]]) -> PairOrder:
    return PairOrder(sum(right for right, _ in orders), sum(pairs for _, pairs in orders))


def _mean(values: list[float]) -> float:
    return sum(values) / len(values)


def _mood(film: Film) -> str:
    return f"{film.mood:g}"


def _face(film: Film) -> str:
    return "live" if film.live else "with the face" if film.face else "without the face"
