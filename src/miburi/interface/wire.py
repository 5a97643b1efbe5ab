"""The requests and answers of the interface, as pydantic models that OpenAPI describes.

No model has a field for any part of the contact rule, so no request can change it.
"""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

from miburi.feelings.catalogue import FeelingName, TheirFeeling
from miburi.feelings.temperament import Source
from miburi.gestures import Direction
from miburi.live.state import Eight, Share
from miburi.senses.happenings import Kind
from miburi.senses.kinds import Distress
from miburi.senses.tone import Tone

__all__ = [
    "BodyIn",
    "BodyOut",
    "EffortIn",
    "ExpressIn",
    "FaceIn",
    "FeltOut",
    "GestureOut",
    "HandIn",
    "LinkOut",
    "LookIn",
    "Message",
    "Name",
    "PartOut",
    "PauseIn",
    "Point",
    "RecordingIn",
    "RecordingOut",
    "Refusal",
    "RobotOut",
    "SayIn",
    "SayOut",
    "SenseIn",
    "SpeakIn",
    "StimulusIn",
    "TemperamentIn",
    "WhyOut",
]

Point = Annotated[list[Annotated[float, Field(ge=-2, le=2)]], Field(min_length=3, max_length=3)]
Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_-]{0,39}$")]


class Message(BaseModel):
    """What a client sends: no unknown keys, no NaN, no silent conversions."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


class StimulusIn(Message):
    """Something that the partner shall feel."""

    feeling: FeelingName
    strength: Share = 0.7
    source: Source = "application"


class SayIn(Message):
    """What somebody says to the partner, in English or Japanese."""

    text: Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=1000)]
    tone: Tone = Field(default="plain", description="How it was said; weighs what the words say.")


class WhyOut(BaseModel):
    """A word, and how much it spoke for the feeling (log-odds over none)."""

    what: str
    weight: float


class FeltOut(BaseModel):
    """What moved the partner's feelings."""

    feeling: TheirFeeling
    strength: Share
    source: Source


class SayOut(BaseModel):
    """What was heard in it, why, and what the partner felt at it."""

    feeling: TheirFeeling | None
    strength: Share
    why: list[WhyOut]
    felt: list[FeltOut]
    asked: bool = Field(default=False, description="Whether it was asked what it feels itself.")
    distress: Distress | None = Field(
        default=None, description="What somebody needs help with now; it calls nobody."
    )
    answer: str = Field(description="What it answered, aloud where a page has its voice on.")


class SpeakIn(Message):
    """What the partner shall say aloud; English and Japanese are told apart by their letters."""

    text: Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=300)]


class SenseIn(Message):
    """Something that happened to the partner, as a page noticed it."""

    kind: Kind
    clearness: Share = Field(default=1.0, description="How clear or sudden it was.")


class FaceIn(Message):
    """Where in a camera's picture a face is; the picture itself stays in the page."""

    x: Share | None = Field(description="Its middle, of the width from the left; null: nobody.")


class EffortIn(Message):
    """Laban's effort, to replace the effort in a gesture's file."""

    space: Share
    weight: Share
    time: Share
    flow: Share


class ExpressIn(Message):
    """A gesture to perform once, whatever the feelings are."""

    feeling: FeelingName
    mood: Share = Field(default=0.7, description="The intensity μ.")
    blend: dict[FeelingName, Share] = Field(
        default_factory=dict, description="Other feelings' gestures to mix in, each with its μ."
    )
    effort: EffortIn | None = None


class LookIn(Message):
    """Where to look, and for how long; ``user`` is ahead, ``aside`` looks thoughtful."""

    at: Direction
    seconds: Annotated[float, Field(ge=0, le=30)] = 2.0


class HandIn(Message):
    """A place for the simulated human hand; a null position takes it away."""

    position: Point | None = Field(description="The middle of the fingers, m in the base frame.")
    along: Point = Field(default=[0.0, 0.0, 1.0], description="The direction of the fingers.")


class BodyIn(Message):
    """The body to change to."""

    name: Name
    port: Annotated[str, Field(max_length=200)] | None = None


class PauseIn(Message):
    """Whether the partner rests at neutral; it still feels, and still stops when touched."""

    paused: bool


class TemperamentIn(Message):
    """The temperament to change to."""

    name: Name


class RecordingIn(Message):
    """Whether to start or end a recording."""

    on: bool


class GestureOut(BaseModel):
    """A movement function."""

    name: str
    feeling: TheirFeeling
    duration: float = Field(description="s at tempo 1, repeats not counted.")
    effort: EffortIn


class BodyOut(BaseModel):
    """A kind of body."""

    name: str
    available: bool
    needs_port: bool
    chosen: bool


class RecordingOut(BaseModel):
    """A recording; ``whole`` is false until it has ended properly."""

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
    """The robot's description, from which a viewer can draw it."""

    name: str
    joints: list[str]
    feelings: list[str]
    sources: list[str]
    temperaments: list[str]
    neutral: Eight
    lower: Eight
    upper: Eight
    floor: float = Field(description="Height of the table, m.")
    threshold: float = Field(
        description="The contact rule's limit on measured over expected travel."
    )
    hand: list[float] = Field(description="The human hand: radius and half length, m.")
    hand_away: list[float]
    links: list[LinkOut]
    parts: list[PartOut]


class Refusal(BaseModel):
    """The reason for a refusal, in words."""

    detail: str
