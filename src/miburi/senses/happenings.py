"""Things that happen to the partner besides speech: touches, motion, sounds, faces.

An impression is made from the kind of an event and from its clarity. ``happenings.toml``, beside
this module, has the feelings for each kind.
"""

import tomllib
from functools import cache
from importlib import resources
from typing import Literal

from pydantic import TypeAdapter

from miburi.feelings.catalogue import FeelingName
from miburi.feelings.temperament import Share, Source
from miburi.ground.tables import Table
from miburi.senses.impression import Brought, Impression

__all__ = ["MAKES_UP", "Happening", "Kind", "happenings", "notice"]

Kind = Literal[
    "pat", "stroke", "hold", "lead", "poke", "lift", "knock", "shake", "shake_on", "drop",
    "startle", "smile", "surprised_face", "sad_face", "angry_face", "scared_face", "disgusted_face",
    "greet",
]  # fmt: skip
#: A caress within this time after a contact stop makes up for it, s (ours).
MAKES_UP = 60.0


class Happening(Table):
    """The effect of one kind of happening; ``happenings.toml`` explains each key."""

    source: Source
    feeling: FeelingName
    strength: Share
    after_contact: Share | None = None


@cache
def happenings() -> dict[Kind, Happening]:
    """Return the effect of each kind; the file is read once."""
    text = (resources.files(__package__) / "happenings.toml").read_text(encoding="utf-8")
    return TypeAdapter(dict[Kind, Happening]).validate_python(tomllib.loads(text))


def notice(kind: Kind, clearness: float = 1.0, *, since_contact: float | None = None) -> Impression:
    """Return the impression that a happening makes.

    Parameters
    ----------
    kind
        What happened.
    clearness
        How clear, or how sudden, it was, 0 to 1; the strength is multiplied by it.
    since_contact
        s since the latest contact stop; None: there was none.

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
