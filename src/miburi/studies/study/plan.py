"""What a study asks: films, questions, languages and trials, read from one TOML file.

``miburi study new`` writes a file to start from; docs/study.md says what each key does.
"""

import hashlib
from collections import Counter
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from miburi.feelings import FEELINGS
from miburi.feelings.catalogue import CATALOGUE, FeelingName
from miburi.ground.tables import Table, load_table

__all__ = [
    "FILE",
    "NONE",
    "TEMPLATE",
    "Film",
    "Item",
    "Question",
    "Show",
    "Step",
    "Study",
    "load_study",
    "pick",
]

#: The study's file in its folder.
FILE = "study.toml"
#: The study that ships, to start from.
TEMPLATE = Path(__file__).with_name("eight-feelings.toml")
#: What is kept when somebody chooses the option that is no feeling.
NONE = "none"

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
    """One film: the feeling and mood that it is meant to show, with the face or a blank screen.

    ``file`` is the study's own film; without one Miburi draws it. Or it is ``live``: no film, but
    a gesture of the robot in the room.
    """

    feeling: str
    mood: float
    face: bool
    file: str | None = None
    live: bool = False

    @property
    def name(self) -> str:
        """The name in answers and on the disk."""
        if self.file is not None:
            return Path(self.file).stem
        kind = "-live" if self.live else "-face" if self.face else ""
        return f"{self.feeling}-{self.mood:g}{kind}"


class Show(Table):
    """Films of every feeling at every mood, without or with the face; or one film of your own.

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
            raise ValueError("what is live has no file and no faces; its phone shows what it shows")
        return self


class Item(Table):
    """One row of a rating: two words, and points between them."""

    name: Name
    low: Text
    high: Text
    #: Whether a high value means less of what the question measures.
    reversed: bool = False


class Question(Table):
    """One question, on a page of its own."""

    name: Name
    kind: Literal["choice", "word", "rating"]
    ask: Text
    #: Asked after each film, or once at the end.
    after: Literal["film", "all"] = "film"
    #: Of a choice: the feelings to choose from; default: those of all films.
    options: Annotated[tuple[FeelingName, ...], Field(strict=False)] = ()
    #: Of a choice: the words of a last option that is no feeling; default: there is none.
    none: Text | None = None
    #: Of a rating: its rows, and the points of each.
    items: Annotated[tuple[Item, ...], Field(strict=False)] = ()
    points: Annotated[int, Field(ge=2, le=11)] = 7

    @model_validator(mode="after")
    def _check_kind(self) -> Self:
        if self.kind == "choice" and self.after == "all":
            raise ValueError("a choice of feelings belongs to a film; leave after out")
        if self.kind != "choice" and (self.options or self.none):
            raise ValueError(f"options and none are for a choice, this is a {self.kind}")
        if (self.kind == "rating") != bool(self.items):
            raise ValueError("a rating, and nothing else, has items, at least one")
        _check_once("items", [item.name for item in self.items])
        _check_once("options", self.options)
        return self

    @property
    def texts(self) -> list[dict[Language, str]]:
        """All its words."""
        items = [text for item in self.items for text in (item.low, item.high)]
        return [self.ask, *([self.none] if self.none else []), *items]


@dataclass(frozen=True)
class Step:
    """One page of a participant: a question, about the film at a place in the order, or about all.

    ``trial`` counts from 0; None at the end.
    """

    trial: int | None
    question: Question


class Study(Table):
    """A study."""

    name: Name
    seed: Annotated[int, Field(ge=0)] = 1
    languages: Annotated[tuple[Language, ...], Field(strict=False, min_length=1)]
    title: Text
    information: Text
    #: How many films each participant sees; default: each once.
    trials: Annotated[int | None, Field(ge=1, le=1000)] = None
    show: Annotated[tuple[Show, ...], Field(strict=False, min_length=1)]
    question: Annotated[tuple[Question, ...], Field(strict=False, min_length=1)]

    @cached_property
    def films(self) -> tuple[Film, ...]:
        """Every film, in the order of the file."""
        return tuple(film for show in self.show for film in show.films)

    @cached_property
    def steps(self) -> tuple[Step, ...]:
        """The pages of every participant; which film a trial shows is :mod:`.order`'s matter."""
        each = [question for question in self.question if question.after == "film"]
        last = [question for question in self.question if question.after == "all"]
        trials = self.trials or len(self.films)
        asked = [Step(trial, question) for trial in range(trials) for question in each]
        return (*asked, *(Step(None, question) for question in last))

    @cached_property
    def digest(self) -> str:
        """A check sum of the whole file: answers belong to one."""
        return hashlib.sha256(self.model_dump_json().encode()).hexdigest()

    def options(self, question: Question) -> tuple[str, ...]:
        """Return what a choice may be: feelings, and perhaps :data:`NONE` at the end."""
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
        _check_once("films", [film.name for film in self.films])
        _check_once("questions", [question.name for question in self.question])
        _check_once("languages", self.languages)
        if all(question.after == "all" for question in self.question):
            raise ValueError('no question is asked after a film; one needs after = "film"')
        texts = [self.title, self.information, *(t for q in self.question for t in q.texts)]
        for text in texts:
            if missing := [language for language in self.languages if language not in text]:
                beginning = next(iter(text.values()))[:40]
                raise ValueError(f"{beginning!r} is missing in {', '.join(missing)}")
        return self


def pick(text: dict[Language, str], language: str) -> str:
    """Return the words in a language of the study."""
    return next(words for key, words in text.items() if key == language)


def load_study(folder: Path) -> Study:
    """Read and check ``study.toml`` in a folder.

    Raises
    ------
    DescriptionError
        It cannot be read, or a key is missing, unknown or out of range.
    """
    return load_table(Study, folder / FILE)


def _check_once(what: str, names: tuple[str, ...] | list[str]) -> None:
    if twice := [name for name, count in Counter(names).items() if count > 1]:
        raise ValueError(f"{', '.join(twice)} is there twice among the {what}")
