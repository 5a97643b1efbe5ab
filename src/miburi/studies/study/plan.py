"""The plan of a study: films, questions, languages and trials, from one TOML file.

``miburi study new`` writes a template; docs/study.md explains each key.
"""

import hashlib
import json
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal, Self, get_args

from pydantic import Field, model_validator

from miburi.feelings import FEELINGS
from miburi.feelings.catalogue import CATALOGUE, FeelingName
from miburi.ground.tables import Table, load_table

#: The study's file in its folder.
FILE = "study.toml"
#: The study that ships with Miburi, as a template.
TEMPLATE = Path(__file__).with_name("eight-feelings.toml")
#: The stored answers for the option "no feeling", and for a question that was not asked or was left
#: out.
NONE, SKIPPED = "none", ""
#: Words in quotation marks, and placeholders that the author must fill in.
_QUOTED = re.compile('[“"「『](.+?)[”"」』]')
_UNFILLED = re.compile(r"\(WRITE: [^)]*\)|（記入：[^）]*）")

Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_-]{0,39}$")]
Mood = Annotated[float, Field(ge=0, le=1)]
Language = Literal["en", "ja"]
#: Words by language.
Text = Annotated[
    dict[Language, Annotated[str, Field(min_length=1, max_length=5000)]],
    Field(min_length=1),
]


@dataclass(frozen=True)
class Film:
    """A film: the feeling and mood that it is meant to show, with the face or a blank screen.

    ``file`` is the study's own film; without it Miburi draws one. If ``live``, it is a gesture of
    the robot in the room instead.
    """

    feeling: str
    mood: float
    face: bool
    file: str | None = None
    live: bool = False

    @property
    def name(self) -> str:
        """The film's name in answers and in the names of files."""
        if self.file is not None:
            return Path(self.file).stem
        kind = "-live" if self.live else "-face" if self.face else ""
        return f"{self.feeling}-{self.mood:g}{kind}"


class Show(Table):
    """Films of each feeling at each mood, with or without the face; or one film of your own.

    With ``live`` the robot in the room makes the gestures, with the face that its phone shows.
    """

    feelings: Annotated[tuple[FeelingName, ...], Field(strict=False, min_length=1)]
    moods: Annotated[tuple[Mood, ...], Field(strict=False, min_length=1)]
    faces: Annotated[tuple[bool, ...], Field(strict=False, min_length=1)] = (False,)
    file: Annotated[str | None, Field(pattern=r"^[a-z0-9][a-z0-9_.-]*\.(mp4|webm|png|jpg)$")] = None
    live: bool = False

    @cached_property
    def films(self) -> tuple[Film, ...]:
        """Every film."""
        return tuple(
            Film(feeling, mood, face, self.file, self.live)
            for feeling in self.feelings
            for mood in self.moods
            for face in self.faces
        )

    @model_validator(mode="after")
    def _check_file(self) -> Self:
        if self.file is not None and len(self.films) > 1:
            raise ValueError("a film of your own shows one feeling, at one mood, with one face")
        if self.live and (self.file is not None or self.faces != (False,)):
            raise ValueError("live gestures have no file and no faces; the phone shows the face")
        return self


class Item(Table):
    """One row of a rating: two opposite words, and a number of points between them."""

    name: Name
    low: Text
    high: Text
    #: Whether a high value means less of what the question measures.
    reversed: bool = False


class Option(Table):
    """A possible answer to a question about the person, in words."""

    name: Name
    words: Text


class Question(Table):
    """One question, on a separate page.

    A ``choice`` is between feelings, a ``pick`` between answers that the study defines, such as yes
    and no. A ``check`` tests whether somebody reads the pages: its text says what to choose.
    """

    name: Name
    kind: Literal["choice", "word", "rating", "pick", "number", "check"]
    ask: Text
    #: Whether the question is asked before the films, after each film, or at the end; a check comes
    #: after the film number ``at``.
    after: Literal["start", "film", "all"] = "film"
    #: For a word, a pick or a number: whether participants may leave the question out.
    optional: bool = False
    #: For a choice or a check: the feelings to choose from, by default the feelings of all films.
    options: Annotated[tuple[FeelingName, ...], Field(strict=False)] = ()
    #: For a check: the right option, and the number of films after which it is asked.
    right: FeelingName | None = None
    at: Annotated[int | None, Field(ge=1)] = None
    #: For a pick: the answers to pick from.
    answers: Annotated[tuple[Option, ...], Field(strict=False)] = ()
    #: For a number: the smallest and the largest allowed.
    low: int = 0
    high: int = 120
    #: The name of the choice right before this question, which is then asked only if a feeling was
    #: chosen there.
    only_if: Name | None = None
    #: For a choice: the text of a last option for no feeling; by default there is none.
    none: Text | None = None
    #: For a rating: its rows, and the number of points in each.
    items: Annotated[tuple[Item, ...], Field(strict=False)] = ()
    points: Annotated[int, Field(ge=2, le=11)] = 7

    @model_validator(mode="after")
    def _check(self) -> Self:
        _refuse(self._mistakes())
        return self

    def _mistakes(self) -> Iterator[str]:
        about_feelings = self.kind in ("choice", "check")
        for wrong, message in (
            (about_feelings and self.after != "film",
             "a choice of feelings belongs to a film; leave out 'after'"),
            (not about_feelings and (self.options or self.none),
             f"only a choice has 'options' and 'none', and this is a {self.kind}"),
            ({self.kind == "check"} != {self.right is not None, self.at is not None},
             "a check needs both 'right' and 'at'; no other question has them"),
            ((self.kind == "pick") != (len(self.answers) > 1),
             "a pick needs at least two answers; nothing else has answers"),
            (self.optional and self.kind not in ("word", "pick", "number"),
             "only a word, a pick or a number may be optional"),
            (self.low >= self.high,
             f"low must be less than high, got {self.low} and {self.high}"),
            ((self.kind == "rating") != bool(self.items),
             "a rating needs at least one item; nothing else has items"),
        ):  # fmt: skip
            if wrong:
                yield message
        yield from _twice("items", [item.name for item in self.items])
        yield from _twice("options", self.options)
        yield from _twice("answers", [option.name for option in self.answers])

    @property
    def texts(self) -> list[dict[Language, str]]:
        """All texts of the question, by language."""
        items = [text for item in self.items for text in (item.low, item.high)]
        answers = [option.words for option in self.answers]
        return [self.ask, *([self.none] if self.none else []), *items, *answers]


@dataclass(frozen=True)
class Step:
    """One page for a participant: a question about one film, or about none.

    ``trial`` counts from 0, and is negative for practice; None if the question is not about a film.
    """

    trial: int | None
    question: Question

    @property
    def practice(self) -> bool:
        """Whether the page is for practice, so that its answer does not count."""
        return self.trial is not None and self.trial < 0


class Exclude(Table):
    """Rules, made before any answer, for leaving participants out of the findings."""

    #: Leave out participants with at least this many wrong checks.
    checks: Annotated[int | None, Field(ge=1)] = None
    #: Leave out participants whose median time on pages about films, in s, is below this.
    fastest: Annotated[float | None, Field(gt=0)] = None
    #: Leave out participants who choose one feeling for more than this share of the films.
    same: Annotated[float | None, Field(gt=0, lt=1)] = None
    #: Leave out participants who started less than this share of the films; known only where a
    #: browser runs scripts.
    unplayed: Annotated[float | None, Field(gt=0, le=1)] = None


class Study(Table):
    """A whole study, as its file describes it."""

    name: Name
    seed: Annotated[int, Field(ge=0)] = 1
    languages: Annotated[tuple[Language, ...], Field(strict=False, min_length=1)]
    title: Text
    information: Text
    #: The text after the thanks, which people who stop early see, too; and the address of the link
    #: on the page with thanks, for instance the address of a participant panel.
    debriefing: Text | None = None
    completion: Annotated[str | None, Field(pattern=r"^https://\S+$")] = None
    #: How many films each participant sees (by default each film once), and how many for practice
    #: before them.
    trials: Annotated[int | None, Field(ge=1, le=1000)] = None
    practice: Annotated[int, Field(ge=0, le=10)] = 0
    #: Whether to store how long each answer took, and how often its film was started.
    times: bool = True
    exclude: Exclude = Exclude()
    show: Annotated[tuple[Show, ...], Field(strict=False, min_length=1)]
    question: Annotated[tuple[Question, ...], Field(strict=False, min_length=1)]

    @cached_property
    def films(self) -> tuple[Film, ...]:
        """Every film, in the order of the file."""
        return tuple(film for show in self.show for film in show.films)

    @cached_property
    def steps(self) -> tuple[Step, ...]:
        """The pages of every participant; :mod:`.order` decides which film a trial shows."""
        first, each, last = (
            [question for question in self.question if question.after == after]
            for after in ("start", "film", "all")
        )
        checks = [question for question in each if question.kind == "check"]
        each = [question for question in each if question.kind != "check"]
        steps = [Step(None, question) for question in first]
        for trial in range(-self.practice, self.trials or len(self.films)):
            steps += [Step(trial, question) for question in each]
            steps += [Step(None, check) for check in checks if check.at == trial + 1]
        return (*steps, *(Step(None, question) for question in last))

    @cached_property
    def digest(self) -> str:
        """A checksum of the questions without their wording; answers belong to one checksum."""
        return _digest(_without_words(self.model_dump(mode="json")))

    @cached_property
    def wording(self) -> str:
        """A checksum of the words."""
        return _digest(self.model_dump(mode="json"))

    @property
    def unfilled(self) -> list[str]:
        """Places that the author still has to fill in, in the order of the file."""
        texts = [self.information, *([self.debriefing] if self.debriefing else [])]
        every = " ".join(words for text in texts for words in text.values())
        return _UNFILLED.findall(every)

    def options(self, question: Question) -> tuple[str, ...]:
        """Return the options of a choice: feelings, and then :data:`NONE` if it may be chosen."""
        shown = {film.feeling for film in self.films}
        options = question.options or tuple(name for name in FEELINGS if name in shown)
        return (*options, NONE) if question.none else options

    def words(self, question: Question, option: str, language: str) -> str:
        """Return an option in words."""
        if option == NONE and question.none is not None:
            return pick(question.none, language)
        (feeling,) = (each for each in CATALOGUE.feeling if each.name == option)
        return feeling.words.get(language, option)

    @model_validator(mode="after")
    def _check(self) -> Self:
        _refuse(self._mistakes())
        return self

    def _mistakes(self) -> Iterator[str]:
        yield from _twice("films", [film.name for film in self.films])
        yield from _twice("questions", [question.name for question in self.question])
        yield from _twice("languages", self.languages)
        if not any(q.after == "film" and q.kind != "check" for q in self.question):
            yield 'no question is asked after a film; set after = "film" in at least one'
        choices = [question.name for question in self.question if question.kind == "choice"]
        seen = self.trials or len(self.films)
        for question in self.question:
            if question.only_if is not None and question.only_if not in choices:
                yield f"only_if must name a choice, one of {choices}; got {question.only_if!r}"
            else:
                yield from self._wrong_order(question)
            yield from self._wrong_right(question)
            if (question.at or 0) > seen:
                yield f"{question.name}: at is {question.at}, but a participant sees {seen} films"
        texts = [self.title, self.information, *(t for q in self.question for t in q.texts)]
        texts += [self.debriefing] if self.debriefing else []
        for text in texts:
            if missing := [language for language in self.languages if language not in text]:
                beginning = next(iter(text.values()))[:40]
                yield f"{beginning!r} is missing in {', '.join(missing)}"

    def _wrong_right(self, question: Question) -> Iterator[str]:
        """Check that the right answer is an option, and is quoted if the text quotes feelings."""
        right = question.right
        if right is None:
            return
        if right not in self.options(question):
            yield f"{question.name}: 'right' is {right!r}, which is not one of its options"
        for language, text in question.ask.items():
            quoted = {said.casefold() for said in _QUOTED.findall(text)}
            named = [
                one for one in FEELINGS if self.words(question, one, language).casefold() in quoted
            ]
            if named and right not in named:
                yield (
                    f"{question.name}: 'right' is {right!r}, but its text ({language}) names "
                    f"{', '.join(named)}"
                )

    def _wrong_order(self, question: Question) -> Iterator[str]:
        """Check that only questions with the same only_if come between a choice and this one."""
        if question.only_if is None:
            return
        each = [one for one in self.question if one.after == "film" and one.kind != "check"]
        before = each[each.index(question) - 1] if question in each[1:] else None
        if before is None or question.only_if not in (before.name, before.only_if):
            yield f"{question.name} has only_if, so it must come right after {question.only_if}"


def pick(text: dict[Language, str], language: str) -> str:
    """Return the words in a language of the study."""
    return next(words for key, words in text.items() if key == language)


def load_study(folder: Path) -> Study:
    """Read and check ``study.toml`` in a folder.

    Raises DescriptionError if it cannot be read, or a key is missing, unknown or out of range.
    """
    return load_table(Study, folder / FILE)


def _without_words(value: object) -> object:
    """Return a dumped model without its texts (tables by language) and ``completion``."""
    if isinstance(value, dict):
        kept = {key: one for key, one in value.items() if not _is_text(one)}
        return {key: _without_words(one) for key, one in kept.items() if key != "completion"}
    return [_without_words(one) for one in value] if isinstance(value, list) else value


def _is_text(value: object) -> bool:
    return isinstance(value, dict) and bool(value) and set(value) <= set(get_args(Language))


def _digest(value: object) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()


def _refuse(mistakes: Iterator[str]) -> None:
    if found := list(mistakes):
        raise ValueError("; ".join(found))


def _twice(what: str, names: tuple[str, ...] | list[str]) -> Iterator[str]:
    if twice := [name for name, count in Counter(names).items() if count > 1]:
        yield f"{', '.join(twice)} appears twice among the {what}"
