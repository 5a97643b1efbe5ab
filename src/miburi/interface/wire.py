"""The requests and answers of the interface, as pydantic models that OpenAPI describes.

No model has a field for any part of the contact rule, so no request can change it.
"""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

from miburi.feelings.catalogue import FeelingName, TheirFeeling
from miburi.feelings.temperament import Source
from miburi.gestures import Direction
from miburi.gestures.movement import Posture, Repeat
from miburi.live.state import Eight, Share
from miburi.senses.happenings import Kind
from miburi.senses.kinds import Distress
from miburi.senses.tone import Tone

__all__ = [
    "AnyAct",
    "BodyIn",
    "BodyOut",
    "EffortIn",
    "ExpressIn",
    "FaceIn",
    "FeltOut",
    "GestureAct",
    "GestureOut",
    "HandIn",
    "LinkOut",
    "LookAct",
    "LookIn",
    "Message",
    "Name",
    "PartOut",
    "PauseIn",
    "PerformanceIn",
    "Point",
    "PosesAct",
    "PosesIn",
    "RecordingIn",
    "RecordingOut",
    "Refusal",
    "RobotOut",
    "SayIn",
    "SayOut",
    "SenseIn",
    "SpeakIn",
    "SpeechAct",
    "StimulusIn",
    "TemperamentIn",
    "WhyOut",
    "WishOut",
    "WordsIn",
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


class PosesIn(Message):
    """Key poses of one's own, written as in a gesture file, to perform once."""

    pose: list[Posture] = Field(
        min_length=1, max_length=32, description="The key poses, in the order of their phases."
    )
    duration: float = Field(
        ge=0.2, le=20, description="s from neutral to neutral at tempo 1.", examples=[2.0]
    )
    effort: EffortIn = Field(
        default=EffortIn(space=1.0, weight=0.5, time=0.5, flow=0.5),
        description="Laban's effort at full intensity.",
    )
    hedge: Literal["plainly", "very", "more or less"] = Field(
        default="plainly", description="How the intensity counts: μ, μ², or √μ."
    )
    repeat: Repeat | None = Field(default=None, description="A range of poses to play again.")
    mood: Share = Field(default=1.0, description="The intensity μ.")
    feeling: FeelingName | None = Field(
        default=None, description="The feeling that body and face show; null: none."
    )


_Offset = Annotated[
    float, Field(ge=0, le=60, description="When it is due, s after the performance's beginning.")
]


class GestureAct(ExpressIn):
    """A feeling's gesture within a performance."""

    do: Literal["gesture"] = Field(description="What kind of act this is.")
    offset: _Offset = 0.0


class LookAct(LookIn):
    """A look within a performance."""

    do: Literal["look"] = Field(description="What kind of act this is.")
    offset: _Offset = 0.0


class PosesAct(PosesIn):
    """Key poses within a performance."""

    do: Literal["poses"] = Field(description="What kind of act this is.")
    offset: _Offset = 0.0


class SpeechAct(SpeakIn):
    """A sentence within a performance."""

    do: Literal["speech"] = Field(description="What kind of act this is.")
    offset: _Offset = 0.0


AnyAct = Annotated[GestureAct | LookAct | PosesAct | SpeechAct, Field(discriminator="do")]


class PerformanceIn(Message):
    """Gestures, looks, key poses and sentences together.

    Acts of the body follow one another, each when it is due and the one before has ended;
    sentences go beside them.
    """

    acts: list[AnyAct] = Field(min_length=1, max_length=20, description="What to do.")
    when: Literal["next", "now"] = Field(
        default="next",
        description="`next`: after what waits. `now`: instead of what is on and what waits.",
    )


class WishOut(BaseModel):
    """What was asked for; events that belong to it carry its id as `wish`."""

    id: str = Field(description="The wish's id, BOOT:NUMBER.", examples=["5f2c9a10:42"])


class WordsIn(Message):
    """Whether events may tell what is said to the partner."""

    allowed: bool = Field(description="false also forgets what has been kept.", examples=[False])


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
