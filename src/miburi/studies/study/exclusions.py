"""Which participants are left out of a study's findings, by a rule fixed before any answer."""

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from statistics import median

from miburi.studies.study.kept import AnswerPace, StudyAnswer
from miburi.studies.study.plan import NONE, Study


@dataclass(frozen=True)
class LeftOut:
    """A participant who is left out, with the reasons in words."""

    participant: int
    reasons: tuple[str, ...]


def left_out(
    study: Study, answers: Sequence[StudyAnswer], paces: Mapping[tuple[int, int], AnswerPace]
) -> tuple[LeftOut, ...]:
    """Return the participants that the study's table ``[exclude]`` leaves out, by number."""
    each: dict[int, list[StudyAnswer]] = defaultdict(list)
    for answer in answers:
        each[answer.participant].append(answer)
    starts = started(study, paces)
    found = []
    for number, own in sorted(each.items()):
        pace = {step: value for (who, step), value in paces.items() if who == number}
        plays = [often for (who, _), often in starts.items() if who == number]
        if reasons := tuple(_reasons(study, own, pace, plays)):
            found.append(LeftOut(number, reasons))
    return tuple(found)


def started(
    study: Study, paces: Mapping[tuple[int, int], AnswerPace]
) -> dict[tuple[int, int], int]:
    """Return how often films were started, by participant and trial, where that is known.

    Practice does not count.
    """
    counts: dict[tuple[int, int], int] = defaultdict(int)
    for (number, step), pace in paces.items():
        trial = study.steps[step].trial
        if trial is not None and trial >= 0 and pace.plays is not None:
            counts[number, trial] += pace.plays
    return counts


def _reasons(
    study: Study, own: list[StudyAnswer], pace: Mapping[int, AnswerPace], plays: list[int]
) -> Iterator[str]:
    rule = study.exclude
    right = {question.name: question.right for question in study.question}
    wrong = sum(right[answer.question] not in (None, answer.value) for answer in own)
    if rule.checks is not None and wrong >= rule.checks:
        yield f"{wrong} checks wrong"
    about_films = {answer.step for answer in own if answer.film is not None}
    seconds = [
        taken for step in about_films if (taken := pace.get(step, AnswerPace()).seconds) is not None
    ]
    if rule.fastest is not None and seconds and median(seconds) < rule.fastest:
        yield f"a median of {median(seconds):.1f} s for a page"
    choices = {question.name for question in study.question if question.kind == "choice"}
    for name in sorted(choices):
        given = [answer.value for answer in own if answer.question == name]
        # "None of these" may be honest, however often it is given.
        chosen = Counter(value for value in given if value != NONE)
        if rule.same is not None and len(given) > 2 and chosen:
            feeling, often = chosen.most_common(1)[0]
            if often > rule.same * len(given):
                yield f"{feeling} in {often} of {len(given)} films"
    watched = sum(often > 0 for often in plays)
    if rule.unplayed is not None and plays and watched < rule.unplayed * len(plays):
        yield f"{watched} of {len(plays)} films started"
