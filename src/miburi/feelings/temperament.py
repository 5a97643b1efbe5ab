"""Temperaments: read all constants of the emotional model from a TOML file.

The paper defines eight feelings and three levels, from fast to slow, but prints no constants. So
every number in the temperaments that ship with Miburi is our assumption.
"""

import tomllib
from functools import cache, cached_property
from importlib import resources
from pathlib import Path
from typing import Annotated, Literal, Self, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationInfo, field_validator, model_validator

from miburi.errors import InputError
from miburi.feelings.catalogue import FEELINGS, FeelingName
from miburi.ground.tables import Table, load_table

Array = NDArray[np.float64]

Source = Literal["speech", "face", "touch", "application", "talk"]

#: How much a partner moves while it shows no feeling; partner/rest.toml has the numbers.
RestLevel = Literal["still", "quiet", "lively"]
REST_LEVELS: tuple[RestLevel, ...] = get_args(RestLevel)
#: The possible sources of a stimulus.
SOURCES: tuple[Source, ...] = get_args(Source)
#: The three levels, from the fastest to the slowest.
LEVELS: tuple[str, ...] = ("emotion", "feeling", "mood")

#: The weight of stimuli from a conversation if a temperament gives none (our number).
_TALK = 0.5

Share = Annotated[float, Field(ge=0, le=1)]


class TimeConstants(Table):
    """The time in which each level fades to 1/e, in s."""

    emotion: Annotated[float, Field(ge=0.1, le=3600)]
    feeling: Annotated[float, Field(ge=1, le=86_400)]
    mood: Annotated[float, Field(ge=10, le=31_536_000)]

    @model_validator(mode="after")
    def _check_order(self) -> Self:
        if not (2 * self.emotion <= self.feeling and 2 * self.feeling <= self.mood):
            raise ValueError(
                "each level must last at least twice as long as the one before it, got "
                f"emotion {self.emotion}, feeling {self.feeling}, mood {self.mood}"
            )
        return self


class TakeUp(Table):
    """The share of a stimulus that the slower levels take up; the emotion takes up all of it."""

    feeling: Share
    mood: Share

    @model_validator(mode="after")
    def _check_shares(self) -> Self:
        if self.mood > self.feeling:
            raise ValueError(
                f"mood must not exceed feeling, got mood {self.mood} and feeling {self.feeling}"
            )
        return self


class Habituation(Table):
    """The share of effect that a repeated stimulus loses, and the recovery's time constant in s."""

    share: Share
    recovery: Annotated[float, Field(ge=0.1, le=86_400)]


class Turning(Table):
    """How far the waist turns to a face in rad, and its top speed in rad/s (both our choice).

    The waist turns to a face only while the partner shows no feeling; if the angle is 0, it never
    turns.
    """

    turn: Annotated[float, Field(ge=0, le=0.7)] = 0.35
    speed: Annotated[float, Field(ge=0.05, le=0.5)] = 0.2


class Attaching(Table):
    """How slowly an attachment to a person changes, and how far resting moods follow (our choice).

    An attachment has the time constant of a mood, multiplied by ``slower``. The attachment,
    multiplied by ``leaning``, is added to the resting moods.
    """

    slower: Annotated[float, Field(ge=1, le=10_000)] = 500.0
    leaning: Share = 0.5


class Temperament(Table):
    """A character: how fast feelings come and go, and how they affect each other."""

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]
    threshold: Annotated[float, Field(ge=0.001, le=1)]
    at_rest: RestLevel = "quiet"
    time_constants: TimeConstants
    take_up: TakeUp
    habituation: Habituation
    sources: dict[Source, Share]
    lasting: dict[FeelingName, Annotated[float, Field(ge=0.1, le=10)]]
    resting: dict[FeelingName, Annotated[float, Field(ge=0, le=0.9)]]
    effects: dict[FeelingName, dict[FeelingName, Annotated[float, Field(ge=-1, le=1)]]]
    #: The partner's reaction to somebody's feelings. A feeling without a row is contagious: the
    #: partner feels the same.
    empathy: dict[FeelingName, dict[FeelingName, Share]] = Field(default_factory=dict)
    gaze: Turning = Field(default_factory=Turning)
    attachment: Attaching = Field(default_factory=Attaching)

    @field_validator("sources")
    @classmethod
    def _add_talk(cls, value: dict[str, float]) -> dict[str, float]:
        return {"talk": _TALK} | value

    @field_validator("sources", "lasting", "resting")
    @classmethod
    def _check_complete(cls, value: dict[str, float], info: ValidationInfo) -> dict[str, float]:
        names: tuple[str, ...] = SOURCES if info.field_name == "sources" else FEELINGS
        missing = [name for name in names if name not in value]
        if missing:
            raise ValueError(f"a value for {', '.join(missing)} is missing; add it")
        return value

    @field_validator("effects")
    @classmethod
    def _check_effects(cls, value: dict[str, dict[str, float]]) -> dict[str, dict[str, float]]:
        for feeling, effects in value.items():
            if feeling in effects:
                raise ValueError(
                    f"{feeling} must not act on itself, got {effects[feeling]}; remove that key"
                )
        return value

    @cached_property
    def fading(self) -> Array:
        """Time constants in s, with a row for each level and a column for each feeling."""
        constants = [getattr(self.time_constants, level) for level in LEVELS]
        return _freeze(np.outer(constants, [self.lasting[name] for name in FEELINGS]))

    @cached_property
    def rates(self) -> Array:
        """The rates in 1/s at which the levels fade, with rows and columns as in ``fading``."""
        return _freeze(1 / self.fading)

    @cached_property
    def rest(self) -> Array:
        """The resting mood of each feeling."""
        return _freeze(np.array([self.resting[name] for name in FEELINGS]))

    @cached_property
    def shares(self) -> Array:
        """The share of a stimulus that each level takes up, as an array of shape (3, 1)."""
        return _freeze(np.array([[1.0], [self.take_up.feeling], [self.take_up.mood]]))

    @cached_property
    def weights(self) -> Array:
        """The weight of a stimulus from each source, in the order of ``SOURCES``."""
        return _freeze(np.array([self.sources[name] for name in SOURCES]))

    @cached_property
    def matrix(self) -> Array:
        """The effect of a stimulus (row) on each feeling (column); it is 1 on the diagonal."""
        matrix = np.eye(len(FEELINGS))
        for feeling, effects in self.effects.items():
            for other, effect in effects.items():
                matrix[FEELINGS.index(feeling), FEELINGS.index(other)] = effect
        return _freeze(matrix)


def _freeze(array: Array) -> Array:
    array.flags.writeable = False
    return array


def load_temperament(path: Path | str) -> Temperament:
    """Read and check a temperament file.

    ``path`` is a TOML file with the keys of ``temperaments/default.toml`` and no others;
    ``at_rest``, ``sources.talk`` and the tables ``empathy``, ``gaze`` and ``attachment`` may be
    left out.

    Raises
    ------
    DescriptionError
        The file cannot be read or is not TOML, or a key is missing, unknown or out of range. The
        message names the file and each wrong key, with its value and what is allowed.
    """
    return load_table(Temperament, path)


#: The temperaments that ship with Miburi.
TEMPERAMENTS: tuple[str, ...] = ("default", "calm", "lively", "playful")


def shipped_temperament(name: str = "default") -> Temperament:
    """Return a temperament that ships with Miburi.

    Each was written for the paper's eight feelings. A feeling that a user adds has the
    temperament's time constants as they are, a resting mood of 0.5 and no effect on others, unless
    a temperament file says otherwise.

    Raises
    ------
    InputError
        The name is unknown.
    """
    if name not in TEMPERAMENTS:
        raise InputError(
            f"there is no temperament {name!r}; use one of {', '.join(TEMPERAMENTS)}, "
            "or the path of a .toml file."
        )
    return _shipped(name).model_copy(deep=True)  # a copy, because its tables can be changed


@cache
def _shipped(name: str) -> Temperament:
    """Read a file only once, because a study makes a model for each trial."""
    file = resources.files(__package__) / "temperaments" / f"{name}.toml"
    table = tomllib.loads(file.read_text(encoding="utf-8"))
    for key, value in (("lasting", 1.0), ("resting", 0.5)):
        table[key] = dict.fromkeys(FEELINGS, value) | table[key]
    return Temperament.model_validate(table)
