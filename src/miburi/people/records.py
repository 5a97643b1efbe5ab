"""The file of people and their facts."""

import json
from datetime import datetime
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from miburi.errors import InputError
from miburi.languages import Language

#: Greatest number of letters in a name and in a fact (our choice).
LONGEST_NAME, LONGEST_FACT = 40, 200


class Fact(BaseModel):
    """Something that a person told; ``asked`` if they asked the partner to remember it."""

    model_config = ConfigDict(frozen=True)

    number: int
    text: str = Field(min_length=1, max_length=LONGEST_FACT)
    language: Language
    told: datetime
    due: datetime | None = None
    asked: bool = False


class Acquaintance(BaseModel):
    """Somebody whom the partner knows."""

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
    """Read a file of people.

    Raises InputError if the file is not one of Miburi's.
    """
    try:
        return People.model_validate(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, RecursionError, ValidationError) as error:
        raise InputError(
            f"{path}: this is not a file of people ({type(error).__name__}); if you move it away, "
            "the partner starts over with nobody known."
        ) from error
