"""The list of feelings: their names, words, colours and faces, read from one TOML file.

``feelings.toml``, which ships with Miburi, defines the paper's eight feelings. To use another file,
name it in the environment variable ``MIBURI_FEELINGS``, or call ``miburi --feelings FILE``, which
sets the variable. The file is read when this module is first imported; it applies to the whole
process and to the processes that it starts.
"""

import os
from importlib import resources
from pathlib import Path
from typing import Annotated, Self

from pydantic import AfterValidator, Field, WithJsonSchema, model_validator
from pydantic_core import PydanticKnownError

from miburi.errors import DescriptionError
from miburi.ground.tables import Table, load_table

Colour = Annotated[str, Field(pattern=r"^#[0-9a-f]{6}$")]
Part = Annotated[float | None, Field(ge=0, le=1)]
Turn = Annotated[float | None, Field(ge=-1.5, le=1.5)]
Size = Annotated[float | None, Field(ge=0.1, le=2)]
_Pitch = Annotated[float, Field(ge=60, le=4000)]
_Length = Annotated[float, Field(ge=0.02, le=1)]
Note = Annotated[tuple[_Pitch, _Length], Field(strict=False)]


class Eyes(Table):
    """The numbers from which the eyes are drawn; ``feelings.toml`` explains each."""

    open: Annotated[float | None, Field(ge=0, le=1.5)] = None
    size: Size = None
    slant: Turn = None
    cheek: Part = None
    pupil: Size = None
    spark: Part = None
    right: Turn = None
    down: Turn = None


class Brows(Table):
    """How to draw the brows."""

    lift: Annotated[float | None, Field(ge=-20, le=30)] = None
    tilt: Turn = None
    arch: Annotated[float | None, Field(ge=-1, le=2)] = None
    weight: Size = None
    skew: Turn = None


class Mouth(Table):
    """How to draw the mouth."""

    width: Annotated[float | None, Field(ge=5, le=60)] = None
    down: Annotated[float | None, Field(ge=-15, le=15)] = None
    smile: Annotated[float | None, Field(ge=-30, le=30)] = None
    wave: Annotated[float | None, Field(ge=0, le=10)] = None
    skew: Part = None
    gape: Annotated[float | None, Field(ge=0, le=40)] = None
    upper: Part = None
    square: Annotated[float | None, Field(ge=0.1, le=1)] = None
    teeth: Annotated[float | None, Field(ge=0, le=2)] = None
    tongue: Part = None


class Signs(Table):
    """Signs on the face, such as tears or a blush, and movements of it, such as shaking."""

    blush: Part = None
    tear: Part = None
    sweat: Part = None
    wrinkle: Part = None
    vein: Part = None
    stars: Part = None
    shake: Part = None
    pale: Part = None


class Face(Table):
    """A face; the face of a feeling holds only what differs from the face at rest."""

    tint: Colour
    eyes: Eyes = Eyes()
    brows: Brows = Brows()
    mouth: Mouth = Mouth()
    signs: Signs = Signs()


class Colours(Table):
    """The colours of a feeling: ``paper`` for figures, ``screen`` for the pages of the studio."""

    paper: Colour
    screen: Colour


class Voice(Table):
    """How a feeling sounds; the defaults are for a voice without feeling.

    ``rate`` and ``pitch`` multiply the voice's own, as in the Web Speech API; ``chirp`` holds
    notes, each a frequency in Hz and a length in s.
    """

    rate: Annotated[float, Field(ge=0.5, le=2)] = 1.0
    pitch: Annotated[float, Field(ge=0, le=2)] = 1.1
    chirp: Annotated[tuple[Note, ...], Field(strict=False, min_length=3, max_length=6)] = (
        (659, 0.09),
        (784, 0.09),
        (659, 0.12),
    )


class Feeling(Table):
    """One feeling: its name in files and programs, its words, its colours, voice and face."""

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,39}$")]
    words: dict[str, Annotated[str, Field(min_length=1, max_length=40)]]
    colour: Colours
    voice: Voice = Voice()
    face: Face


class Catalogue(Table):
    """The face at rest, and all feelings; an array with one number per feeling is in this order."""

    rest: Face
    feeling: Annotated[tuple[Feeling, ...], Field(strict=False)]

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the feelings."""
        return tuple(feeling.name for feeling in self.feeling)

    @model_validator(mode="after")
    def _check_complete(self) -> Self:
        missing = [
            f"rest.{part}.{key}"
            for part in ("eyes", "brows", "mouth", "signs")
            for key, value in self.rest.model_dump()[part].items()
            if value is None
        ]
        if missing:
            raise ValueError(
                f"{', '.join(missing)} is missing; the face at rest needs every number"
            )
        twice = sorted({name for name in self.names if self.names.count(name) > 1})
        if twice:
            raise ValueError(f"{', '.join(twice)} appears twice; each feeling needs its own name")
        return self

    def faces(self) -> dict[str, object]:
        """Return how to draw all faces, ready for JSON: ``rest``, and ``feelings`` in order."""
        return {
            "rest": self.rest.model_dump(),
            "feelings": [
                {"name": feeling.name, **feeling.face.model_dump(exclude_none=True)}
                for feeling in self.feeling
            ],
        }

    def voice(self, name: str | None) -> Voice:
        """Return the voice of a feeling; None stands for no feeling."""
        return next((each.voice for each in self.feeling if each.name == name), Voice())

    def voices(self) -> dict[str, object]:
        """Return each feeling's voice, ready for JSON, and ``rest``, the voice of no feeling."""
        each = {feeling.name: feeling.voice.model_dump() for feeling in self.feeling}
        return {"rest": Voice().model_dump(), "feelings": each}


def load_catalogue(path: Path | str) -> Catalogue:
    """Read and check a file of feelings.

    ``path`` is a TOML file like ``feelings.toml``, with the paper's eight feelings in any order,
    and any others.

    Raises
    ------
    DescriptionError
        The file cannot be read, a key is missing, unknown or out of range, or one of the paper's
        eight is missing: the greeting, the shipped temperaments and the experiment need them.
    """
    catalogue = load_table(Catalogue, path)
    missing = [name for name in PAPER if name not in catalogue.names]
    if missing:
        raise DescriptionError(
            f"{path}: {', '.join(missing)} is missing; a file of feelings must define the "
            "eight standard ones, and may add others."
        )
    return catalogue


with resources.as_file(resources.files(__package__) / "feelings.toml") as _path:
    #: The catalogue that ships with Miburi.
    SHIPPED = load_table(Catalogue, _path)
#: The paper's eight feelings (Section 4).
PAPER = SHIPPED.names
_CHOSEN = os.environ.get("MIBURI_FEELINGS")
#: The feelings of this process.
CATALOGUE = load_catalogue(_CHOSEN) if _CHOSEN else SHIPPED
#: The names of this process's feelings; arrays with a number for each feeling follow this order.
FEELINGS = CATALOGUE.names


def _check_name(name: str) -> str:
    if name not in FEELINGS:
        *most, last = (f"'{feeling}'" for feeling in FEELINGS)
        raise PydanticKnownError("literal_error", {"expected": f"{', '.join(most)} or {last}"})
    return name


#: The type of a feeling's name in a message or a file; pydantic checks it.
FeelingName = Annotated[
    str,
    AfterValidator(_check_name),
    WithJsonSchema({"enum": list(FEELINGS), "type": "string"}),
]
#: A feeling's name in a partner's messages. The name is not checked, because the partner may have
#: other feelings than this process.
TheirFeeling = Annotated[str, WithJsonSchema({"enum": list(FEELINGS), "type": "string"})]
