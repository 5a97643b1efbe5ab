"""What goes over the wire: checked at the door, described by OpenAPI, the same for every client.

Nothing here can name, and so nothing that comes over the net can change, any part of the
contact rule.
"""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from miburi.feelings.catalogue import FeelingName
from miburi.feelings.temperament import Source
from miburi.live.state import Eight, Share

__all__ = [
    "BodyIn",
    "BodyOut",
    "EffortIn",
    "ExpressIn",
    "GestureOut",
    "HandIn",
    "LinkOut",
    "Message",
    "Name",
    "PartOut",
    "PauseIn",
    "Point",
    "RecordingIn",
    "RecordingOut",
    "Refusal",
    "RobotOut",
    "StimulusIn",
    "TemperamentIn",
]

Point = Annotated[list[Annotated[float, Field(ge=-2, le=2)]], Field(min_length=3, max_length=3)]
Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_-]{0,39}$")]


class Message(BaseModel):
    """What a client sends: no unknown keys, no NaN, no silent conversions."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


class StimulusIn(Message):
    """Somebody said, showed or did something."""

    feeling: FeelingName
    strength: Share = 0.7
    source: Source = "application"


class EffortIn(Message):
    """Laban's effort, to perform a gesture otherwise than it is written."""

    space: Share
    weight: Share
    time: Share
    flow: Share


class ExpressIn(Message):
    """A gesture to perform once, whatever the feelings are."""

    feeling: FeelingName
    mood: Share = Field(default=0.7, description="The intensity μ.")
    blend: dict[FeelingName, Share] = Field(
        default_factory=dict, description="Other feelings' gestures to mix in, with their μ."
    )
    effort: EffortIn | None = None


class HandIn(Message):
    """Where the simulated human hand goes; null takes it away."""

    position: Point | None = Field(description="The middle of the fingers, m in the base frame.")
    along: Point = Field(default=[0.0, 0.0, 1.0], description="The direction of the fingers.")


class BodyIn(Message):
    """The body to move from now on."""

    name: Name
    port: Annotated[str, Field(max_length=200)] | None = None


class PauseIn(Message):
    """Whether the partner rests at neutral; it still feels, and still stops when touched."""

    paused: bool


class TemperamentIn(Message):
    """The character to go on with."""

    name: Name


class RecordingIn(Message):
    """Whether to record."""

    on: bool


class GestureOut(BaseModel):
    """A movement function."""

    name: str
    feeling: FeelingName
    duration: float = Field(description="s at tempo 1, repeats not counted.")
    effort: EffortIn


class BodyOut(BaseModel):
    """A kind of body."""

    name: str
    available: bool
    needs_port: bool
    chosen: bool


class RecordingOut(BaseModel):
    """A recording; it is not whole while it is written, or if it was broken off."""

    name: str
    bytes: int
    whole: bool


class LinkOut(BaseModel):
    """A rigid link: its parent, and the joint that turns it."""

    name: str
    parent: str
    joint: str
    position: list[float]
    axis: list[float]


class PartOut(BaseModel):
    """A solid on a link."""

    link: str
    name: str
    kind: str
    size: list[float]
    position: list[float]
    end: list[float] | None
    tilt: float
    colour: list[float]


class RobotOut(BaseModel):
    """The description that the scene is built from."""

    name: str
    joints: list[str]
    feelings: list[str]
    sources: list[str]
    temperaments: list[str]
    neutral: Eight
    lower: Eight
    upper: Eight
    floor: float = Field(description="Height of the table, m.")
    threshold: float = Field(description="The running rule's limit on measured over expected.")
    hand: list[float] = Field(description="The human hand: radius and half length, m.")
    hand_away: list[float]
    links: list[LinkOut]
    parts: list[PartOut]


class Refusal(BaseModel):
    """Why something was not done, in words."""

    detail: str
