"""Compute the findings of a study: numbers for the page and the JSON."""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from statistics import quantiles, stdev
from typing import TypeVar

from miburi.studies.study.exclusions import left_out, started
from miburi.studies.study.found import (
    ChoiceFindings,
    Findings,
    MeanRating,
    PairOrder,
    PersonFindings,
    RatingFindings,
    Share,
    WordFindings,
)
from miburi.studies.study.kept import AnswerPace, Counts, Shown, StudyAnswer
from miburi.studies.study.plan import SKIPPED, Film, Question, Study
from miburi.studies.study.statistics import (
    by_guessing,
    cohen_kappa,
    cronbach_alpha,
    fleiss_kappa,
    mean_interval,
    right_order,
    share_interval,
    unbiased_hit_rates,
)

Value = TypeVar("Value", bool, float)


def find(
    study: Study,
    answers: Sequence[StudyAnswer],
    counts: Counts,
    showings: Mapping[tuple[int, int], Shown],
    paces: Mapping[tuple[int, int], AnswerPace],
    wordings: Sequence[int],
) -> Findings:
    """Summarise the answers of a study, including those of people who did not finish.

    Practice does not count, nor do participants that the study's own rule leaves out.
    """
    films = {film.name: film for film in study.films}
    real = [answer for answer in answers if not study.steps[answer.step].practice]
    out = left_out(study, real, paces)
    gone = {one.participant for one in out}
    kept = [a for a in real if a.participant not in gone and a.value != SKIPPED]
    of = {q.name: [answer for answer in kept if answer.question == q.name] for q in study.question}
    silent = Counter(a.question for a in real if a.participant not in gone and a.value == SKIPPED)
    kinds: dict[str, list[Question]] = defaultdict(list)
    for question in study.question:
        kinds[question.kind].append(question)
    taken = [
        pace.seconds
        for (number, step), pace in paces.items()
        if number not in gone and pace.seconds is not None
        if (trial := study.steps[step].trial) is not None and trial >= 0
    ]
    return Findings(
        counts,
        out,
        tuple(wordings),
        _quartiles(taken),
        sum(not often for (who, _), often in started(study, paces).items() if who not in gone),
        Shown(
            sum(shown.whole for shown in showings.values()),
            sum(shown.broken for shown in showings.values()),
            sum(shown.others for shown in showings.values()),
        ),
        tuple(_person(q, of[q.name], silent[q.name]) for q in kinds["pick"] + kinds["number"]),
        tuple(_choices(study, question, of[question.name], films) for question in kinds["choice"]),
        tuple(_ratings(question, of[question.name], films) for question in kinds["rating"]),
        tuple(_words(question, of[question.name], films) for question in kinds["word"]),
    )


def _person(question: Question, answers: list[StudyAnswer], silent: int) -> PersonFindings:
    if question.kind == "number":
        return PersonFindings(
            question.name, {}, _quartiles([float(answer.value) for answer in answers]), silent
        )
    counts = Counter(answer.value for answer in answers)
    return PersonFindings(
        question.name, {one.name: counts[one.name] for one in question.answers}, None, silent
    )


def _choices(
    study: Study, question: Question, answers: list[StudyAnswer], films: dict[str, Film]
) -> ChoiceFindings:
    options = study.options(question)
    pairs = [(films[answer.film or ""], answer) for answer in answers]
    shown = dict.fromkeys(film.feeling for film in study.films)
    labels = tuple(dict.fromkeys((*options, *shown)))
    count = Counter((film.feeling, answer.value) for film, answer in pairs)
    confusion = tuple(tuple(count[row, column] for column in labels) for row in labels)

    def shares(group: Callable[[Film], str], names: Iterable[str]) -> dict[str, Share]:
        return _shares(
            pairs, {name: [group(film) == name for film, _ in pairs] for name in names}, study.seed
        )

    return ChoiceFindings(
        question.name,
        labels,
        confusion,
        shares(lambda _: "", [""])[""],
        shares(lambda film: film.feeling, shown),
        shares(_mood, sorted({_mood(film) for film in study.films})),
        shares(_face, sorted({_face(film) for film in study.films}, reverse=True)),
        {
            label: rate
            for label, rate in zip(labels, unbiased_hit_rates(confusion), strict=True)
            if label in shown
        },
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
    cells: dict[str, dict[str, list[tuple[int, float]]]] = defaultdict(lambda: defaultdict(list))
    # The two films of a pair were rated by one person and show one feeling. Both were shown with
    # the face, both without it, or both live.
    groups: dict[tuple[int, str, str], list[tuple[float, float]]] = defaultdict(list)
    for page, film in film_of.items():
        if film is not None:
            cells[film.feeling][_mood(film)].append((page[0], value_of[page]))
            groups[page[0], film.feeling, _face(film)].append((film.mood, value_of[page]))
    orders: dict[str, list[tuple[int, float, int]]] = defaultdict(list)
    for (number, feeling, _), pairs in groups.items():
        moods, ratings = zip(*pairs, strict=True)
        orders[feeling].append((number, *right_order(moods, ratings)))
    return RatingFindings(
        question.name,
        question.points,
        _rating([(page[0], value) for page, value in value_of.items()]),
        {
            name: _rating([(page[0], values[name]) for page, values in pages.items()])
            for name in names
            if table
        },
        tuple(name for name in names if name in turned),
        cronbach_alpha(table),
        {
            feeling: {mood: _rating(values) for mood, values in sorted(row.items())}
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
    # Words with equal counts are in alphabetical order, so the same answers give the same page.
    return WordFindings(
        question.name,
        {
            about: sorted(count.items(), key=lambda pair: (-pair[1], pair[0]))
            for about, count in sorted(counts.items())
        },
    )


def _shares(
    pairs: list[tuple[Film, StudyAnswer]], rows: Mapping[str, list[bool]], seed: int
) -> dict[str, Share]:
    """Return the share of right answers in each row of a table."""
    asked = {name: row for name, row in rows.items() if any(row)}
    found = by_guessing(
        [answer.participant for _, answer in pairs],
        [film.feeling for film, _ in pairs],
        [answer.value for _, answer in pairs],
        list(asked.values()),
        seed,
    )
    guessed = dict(zip(asked, found, strict=True))
    shares = {}
    for name, row in rows.items():
        own = [
            (answer.participant, film.feeling == answer.value)
            for (film, answer), inside in zip(pairs, row, strict=True)
            if inside
        ]
        low, high = share_interval(_by_person(own)) or (None, None)
        hits = sum(hit for _, hit in own)
        shares[name] = Share(hits, len(own), low, high, *guessed.get(name, (None, None)))
    return shares


def _rating(values: list[tuple[int, float]]) -> MeanRating:
    numbers = [value for _, value in values]
    low, high = mean_interval(_by_person(values)) or (None, None)
    return MeanRating(
        len(numbers),
        _mean(numbers) if numbers else None,
        stdev(numbers) if len(numbers) > 1 else None,
        low,
        high,
    )


def _sum(orders: list[tuple[int, float, int]]) -> PairOrder:
    right, pairs = sum(one for _, one, _ in orders), sum(one for _, _, one in orders)
    # Each pair in a group (one person and feeling) counts as the group's share of correctly ordered
    # pairs. This leaves the sum unchanged.
    each = [(who, one / of) for who, one, of in orders if of for _ in range(of)]
    low, high = mean_interval(_by_person(each)) or (None, None)
    low, high = (None if end is None else min(max(end, 0.0), 1.0) for end in (low, high))
    return PairOrder(right, pairs, low, high)


def _by_person(values: Iterable[tuple[int, Value]]) -> list[list[Value]]:
    clusters: dict[int, list[Value]] = defaultdict(list)
    for person, value in values:
        clusters[person].append(value)
    return list(clusters.values())


def _quartiles(values: list[float]) -> tuple[float, float, float] | None:
    if not values:
        return None
    if len(values) == 1:
        return values[0], values[0], values[0]
    first, second, third = quantiles(values, n=4, method="inclusive")
    return first, second, third


def _mean(values: list[float]) -> float:
    return sum(values) / len(values)


def _mood(film: Film) -> str:
    return f"{film.mood:g}"


def _face(film: Film) -> str:
    return "live" if film.live else "with the face" if film.face else "without the face"
