"""Read a partner's answers, even if its version of Miburi is newer than this program's.

A newer partner may have words that this version does not know, such as another kind of event. They
are passed on as they are. Anything else that does not fit is an error.
"""

from enum import StrEnum
from typing import Any, TypeVar

from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic_core import from_json, to_json

from miburi.errors import InputError

Answer = TypeVar("Answer")
#: Pydantic's errors for a word that is none of those in a type.
_NEW_WORD = {"literal_error", "enum"}


def read(kind: type[Answer], text: str | bytes, url: str) -> Answer:
    """Return an answer of the partner at ``url``, given as JSON.

    Raises InputError if it is not of this kind.
    """
    answers = TypeAdapter(kind)
    try:
        return answers.validate_json(text)
    except ValidationError as error:
        wrong = error.errors()
        if not all(one["type"] in _NEW_WORD and isinstance(one["input"], str) for one in wrong):
            raise InputError(
                f"{url}: this program does not understand this partner's answer; use the same "
                "version of Miburi for both."
            ) from error
    content = from_json(text)
    for one in wrong:  # a known word in the place of each new one
        _put(content, one["loc"], one["ctx"]["expected"].split("'")[1])
    answer = answers.validate_json(to_json(content))
    for one in wrong:
        _put(answer, one["loc"], one["input"])
    return answer


def _put(within: Any, place: tuple[int | str, ...], word: str) -> None:
    """Change a word within JSON or a model."""
    *outer, last = place
    for key in outer:
        within = getattr(within, str(key)) if isinstance(within, BaseModel) else within[key]
    if isinstance(within, BaseModel):
        setattr(within, str(last), _like(getattr(within, str(last)), word))
    else:
        within[last] = word


def _like(known: object, word: str) -> str:
    """Return a word as a member of the enumeration of a known one, if that is a member."""
    if not isinstance(known, StrEnum):
        return word
    member = str.__new__(type(known), word)
    member._name_ = member._value_ = word
    return member
