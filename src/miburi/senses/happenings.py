"""Things that happen to the partner besides speech: touches, motion, sounds, faces.

An impression is made from the kind of an event and how clear it was. ``happenings.toml``, beside
this module, has the feelings for each kind. A file of your own may add kinds or replace some: name
it in the environment variable ``MIBURI_SENSES``, or call ``miburi run --senses FILE``, which sets
the variable.
"""

import os
from functools import cache
from importlib import resources
from typing import Annotated, Any

from pydantic import AfterValidator, Field, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticKnownError

from miburi.feelings.catalogue import FeelingName
from miburi.feelings.temperament import Share, Source
from miburi.ground.tables import Table, load_table
from miburi.senses.impression import Brought, Impression

_Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,39}$")]
#: For this long after a contact stop, in s, a caress counts as an apology (our choice).
MAKES_UP = 60.0


class Happening(Table):
    """The effect of one kind of happening; ``happenings.toml`` explains each key."""

    source: Source
    feeling: FeelingName
    strength: Share
    after_contact: Share | None = None


class _Happenings(Table):
    happening: dict[_Name, Happening]


@cache
def happenings() -> dict[str, Happening]:
    """Return the effect of each kind; the files are read once.

    Raises
    ------
    DescriptionError
        Your own file cannot be read, or is wrong.
    """
    with resources.as_file(resources.files(__package__) / "happenings.toml") as shipped:
        known = load_table(_Happenings, shipped).happening
    own = os.environ.get("MIBURI_SENSES")
    return known | load_table(_Happenings, own).happening if own else known


def _check_kind(kind: str) -> str:
    if kind not in happenings():
        *most, last = (f"'{each}'" for each in happenings())
        raise PydanticKnownError("literal_error", {"expected": f"{', '.join(most)} or {last}"})
    return kind


class _Listed:
    """Lists the kinds when a JSON schema is made; a client needs no file of its own."""

    @classmethod
    def __get_pydantic_json_schema__(
        cls, _core: CoreSchema, _handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return {"enum": list(happenings()), "type": "string"}


#: The type of a kind in a message; pydantic checks it.
Kind = Annotated[str, AfterValidator(_check_kind), _Listed]


def notice(kind: str, clearness: float = 1.0, *, since_contact: float | None = None) -> Impression:
    """Return the impression that a happening makes.

    ``clearness``, from 0 to 1, is how clear or how sudden it was; the strength is multiplied by it.
    ``since_contact`` is the time since the latest contact stop, in s, or None if there was none.

    Raises
    ------
    InputError
        ``clearness`` is outside [0, 1].
    """
    one = happenings()[kind]
    makes_up = since_contact is not None and since_contact <= MAKES_UP
    strength = one.after_contact if makes_up and one.after_contact is not None else one.strength
    why = (Brought(kind.replace("_", " "), 1.0),)
    return Impression(one.feeling, strength * clearness, one.source, why)
