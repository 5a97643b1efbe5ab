"""The feelings that there are: names, words, colours and faces, from one TOML file.

``feelings.toml``, which ships with Miburi, holds the paper's eight. A file that the environment
variable ``MIBURI_FEELINGS`` names takes its place for the whole process and for those that it
starts; ``miburi --feelings FILE`` sets it. The file is read when this module is first imported.
"""

import os
from importlib import resources
from pathlib import Path
from typing import Annotated, Self

from pydantic import AfterValidator, Field, WithJsonSchema, model_validator
from pydantic_core import PydanticKnownError

from miburi.errors import DescriptionError
from miburi.ground.tables import Table, load_table

__all__ = [
    "CATALOGUE",
    "FEELINGS",
    "PAPER",
    "SHIPPED",
    "Brows",
    "Catalogue",
    "Colours",
    "Eyes",
    "Face",
    "Feeling",
    "FeelingName",
    "Mouth",
    "Signs",
    "load_catalogue",
]

Colour = Annotated[str, Field(pattern=r"^#[0-9a-f]{6}$")]
Part = Annotated[float | None, Field(ge=0, le=1)]
Turn = Annotated[float | None, Field(ge=-1.5, le=1.5)]
Size = Annotated[float | None, Field(ge=0.1, le=2)]


class Eyes(Table):
    """The eyes' numbers; ``feelings.toml`` says what each does."""

    open: Annotated[float | None, Field(ge=0, le=1.5)] = None
    size: Size = None
    slant: Turn = None
    cheek: Part = None
    pupil: Size = None
    spark: Part = None
    right: Turn = None
    down: Turn = None


class Brows(Table):
    """The brows' numbers."""

    lift: Annotated[float | None, Field(ge=-20, le=30)] = None
    tilt: Turn = None
    arch: Annotated[float | None, Field(ge=-1, le=2)] = None
    weight: Size = None
    skew: Turn = None


class Mouth(Table):
    """The mouth's numbers."""

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
    """What appears on the face, or happens to it."""

    blush: Part = None
    tear: Part = None
    sweat: Part = None
    wrinkle: Part = None
    vein: Part = None
    stars: Part = None
    shake: Part = None
    pale: Part = None


class Face(Table):
    """A face, or, for a feeling, what it changes of the face at rest."""

    tint: Colour
    eyes: Eyes = Eyes()
    brows: Brows = Brows()
    mouth: Mouth = Mouth()
    signs: Signs = Signs()


class Colours(Table):
    """The colours of a feeling's lines in figures, and on the studio's light and dark pages."""

    paper: Colour
    screen: Colour


class Feeling(Table):
    """One feeling: its name in files and programs, its words by language, colours and face."""

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,39}$")]
    words: dict[str, Annotated[str, Field(min_length=1, max_length=40)]]
    colour: Colours
    face: Face


class Catalogue(Table):
    """All feelings, in the order of every array, and the face at rest."""

    rest: Face
    feeling: Annotated[tuple[Feeling, ...], Field(strict=False)]

    @property
    def names(self) -> tuple[str, ...]:
        """The feelings' names."""
        return tuple(feeling.name for feeling in self.feeling)

    @model_validator(mode="after")
    def _whole(self) -> Self:
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
            raise ValueError(f"{', '.join(twice)} stands there twice; a name belongs to one")
        return self

    def faces(self) -> dict[str, object]:
        """Return what draws faces, for JSON: the face at ``rest``, and ``feelings`` in order."""
        return {
            "rest": self.rest.model_dump(),
            "feelings": [
                {"name": feeling.name, **feeling.face.model_dump(exclude_none=True)}
                for feeling in self.feeling
            ],
        }


def load_catalogue(path: Path | str) -> Catalogue:
    """Read and check a file of feelings.

    Parameters
    ----------
    path
        A TOML file like ``feelings.toml``: the paper's eight, in any order, and any others.

    Raises
    ------
    DescriptionError
        The file cannot be read, is not TOML, a key is missing, unknown or out of range, or one of
        the paper's eight is missing: the greeting, the temperaments that ship and the experiment
        need them.
    """
    catalogue = load_table(Catalogue, path)
    missing = [name for name in PAPER if name not in catalogue.names]
    if missing:
        raise DescriptionError(
            f"{path}: {', '.join(missing)} is missing; a file of feelings holds the paper's eight, "
            "and may add others."
        )
    return catalogue


with resources.as_file(resources.files(__package__) / "feelings.toml") as _path:
    #: What ships with Miburi.
    SHIPPED = load_table(Catalogue, _path)
#: The paper's eight feelings (Section 4).
PAPER = SHIPPED.names
_CHOSEN = os.environ.get("MIBURI_FEELINGS")
#: The feelings of this process.
CATALOGUE = load_catalogue(_CHOSEN) if _CHOSEN else SHIPPED
#: Their names; every array of a number for each feeling follows their order.
FEELINGS = CATALOGUE.names


def _known(name: str) -> str:
    if name not in FEELINGS:
        *most, last = (f"'{known}'" for known in FEELINGS)
        raise PydanticKnownError("literal_error", {"expected": f"{', '.join(most)} or {last}"})
    return name


#: A feeling's name in a message or a file, checked where it enters.
FeelingName = Annotated[
    str,
    AfterValidator(_known),
    WithJsonSchema({"enum": list(FEELINGS), "type": "string"}),
]
