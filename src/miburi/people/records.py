"""The file of people and their facts."""

import json
import sys
from contextlib import suppress
from datetime import datetime, time
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from miburi.errors import OutputError
from miburi.ground.files import (
    check_readable,
    put_aside,
    put_aside_before,
    remove_whole,
    write_whole,
)
from miburi.languages import Language

#: The time of day at which a fact about a day is due (our choice).
MORNING = time(9)
#: Greatest number of letters in a name and in a fact (our choice).
LONGEST_NAME, LONGEST_FACT = 40, 200


class Fact(BaseModel):
    """A fact that somebody told; ``asked`` says whether they asked the partner to remember it."""

    model_config = ConfigDict(frozen=True)

    number: int
    text: str = Field(min_length=1, max_length=LONGEST_FACT)
    language: Language
    told: datetime
    due: datetime | None = None
    asked: bool = False


class Acquaintance(BaseModel):
    """Somebody whom the partner knows."""

    model_config = ConfigDict(frozen=True)

    name: str = Field(min_length=1, max_length=LONGEST_NAME)
    since: datetime
    seen: datetime
    facts: list[Fact] = Field(default_factory=list)
    attachment: dict[str, Any] | None = None


class People(BaseModel):
    """The whole file."""

    version: int = Field(default=1, ge=1, le=1)
    people: list[Acquaintance] = Field(default_factory=list)

    def find(self, name: str) -> Acquaintance | None:
        """Return a person by name, ignoring case; None if there is no such person."""
        same = (one for one in self.people if one.name.casefold() == name.casefold())
        return next(same, None)


def read_people(path: Path) -> People:
    """Read a file of people; if it is damaged, put it aside as ``*.bad``, and begin a new one.

    Raises InputError if it cannot be read; then it is left as it is.
    """
    check_readable(path)
    try:
        return People.model_validate(json.loads(path.read_text(encoding="utf-8")))
    except (ValueError, RecursionError, ValidationError) as error:
        damage = type(error).__name__
    kept = "the file is left as it is"
    with suppress(OSError, OutputError):  # the disk is read-only, or full
        kept = f"the file is kept as {put_aside(path).name}"
        write_people(path, People())
    print(
        f"miburi: {path} cannot be used ({damage}), so the partner starts with nobody known; "
        f"{kept}.",
        file=sys.stderr,
    )
    return People()


def write_people(path: Path, people: People | None) -> None:
    """Write a file of people; if ``people`` is None, delete it and any file that was put aside.

    Raises OutputError if the disk does not allow it.
    """
    try:
        if people is None:
            for file in (path, *put_aside_before(path)):
                remove_whole(file)
        else:
            write_whole(path, people.model_dump_json(indent=1), private=True)
    except OSError as error:
        raise OutputError(
            f"{path}: the file of people cannot be changed: {error.strerror or error}. Make room "
            "on the disk, or make it writable, and try again."
        ) from error
