"""What is kept of participants, as :mod:`.store` returns it."""

from dataclasses import dataclass

#: A browser's report is ignored if it says that a film was started more often than this (our
#: choice).
_MOST_PLAYS = 100


@dataclass(frozen=True)
class Participant:
    """A participant."""

    number: int  #: identifies them in every export; 1 or more
    place: int  #: their row in the order of the films; 1 or more
    language: str  #: of their pages
    step: int  #: the next page, from 0


@dataclass(frozen=True)
class AnswerPace:
    """How long a participant took for a page, in s, and how often its film was started.

    A value is None if it is unknown: after a restart of the server, or if the browser runs no
    scripts.
    """

    seconds: float | None = None
    plays: int | None = None

    @classmethod
    def told(cls, seconds: float | None, plays: str) -> "AnswerPace":
        """Return a pace with the number of starts that a browser tells, if it makes sense."""
        known = plays.isascii() and plays.isdigit() and int(plays) <= _MOST_PLAYS
        return cls(seconds, int(plays) if known else None)


@dataclass(frozen=True)
class StudyAnswer:
    """One value of one answer; ``item`` is empty unless the question is a rating."""

    participant: int
    language: str
    step: int
    film: str | None
    question: str
    item: str
    value: str


@dataclass(frozen=True)
class Shown:
    """How often somebody saw a live gesture to its end, and how often it was interrupted.

    ``others`` is after how many of these the robot made another gesture before an answer came.
    """

    whole: int = 0
    broken: int = 0
    others: int = 0


@dataclass(frozen=True)
class Counts:
    """How many participants began, how many of these finished, and how many withdrew."""

    began: int
    finished: int
    withdrawn: int
