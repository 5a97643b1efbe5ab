"""The requests and answers of the interface, as pydantic models that OpenAPI describes.

No model has a field for any part of the contact rule, so no request can change it.
"""

import unicodedata
from dataclasses import asdict
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StringConstraints

from miburi.errors import InputError
from miburi.feelings import Expression, Stimulus
from miburi.feelings.catalogue import FeelingName, TheirFeeling
from miburi.feelings.temperament import RestLevel, Source
from miburi.gestures import Direction
from miburi.gestures.movement import Posture, Repeat
from miburi.live.attention import Turn
from miburi.live.state import Share
from miburi.senses.happenings import Kind
from miburi.senses.tone import Tone

#: How many states a second a viewer may ask for.
SLOWEST, FASTEST = 0.1, 50.0
Rate = Annotated[float, Field(ge=SLOWEST, le=FASTEST)]
Point = Annotated[list[Annotated[float, Field(ge=-2, le=2)]], Field(min_length=3, max_length=3)]
#: The most characters of a remark.
_SAID = 1000
Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_-]{0,39}$")]


def _example(**fields: Any) -> ConfigDict:
    return ConfigDict(json_schema_extra={"examples": [fields]})


class Message(BaseModel):
    """A message from a client: no unknown keys, no NaN, no silent conversions."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


class StimulusIn(Message):
    """Something that the partner is to feel."""

    model_config = _example(feeling="happiness", strength=0.8)

    feeling: FeelingName = Field(description="What it feels.")
    strength: Share = Field(default=0.7, description="How strongly, 0 to 1.")
    source: Source = Field(
        default="application", description="Its source; the temperament has a weight for each."
    )


def fields_of(given: Stimulus | Expression, kind: type[Stimulus | Expression]) -> dict[str, Any]:
    """Convert a stimulus or an expression to the fields of a request.

    Raises
    ------
    InputError
        ``given`` is not of this kind.
    """
    if not isinstance(given, kind):
        name = kind.__name__
        raise InputError(
            f'this takes the class {name}, for example {name}("happiness", 0.8); got {given!r}.'
        )
    return asdict(given)


def _spelt_out(text: str) -> str:
    """Return what is said, cut where letters that stand for many, such as "ﷺ", make it too long."""
    plain = unicodedata.normalize("NFKC", text)
    return text if len(plain) <= _SAID else plain[:_SAID]


class SayIn(Message):
    """What somebody says to the partner, in one of its languages."""

    model_config = _example(text="I am so happy today")

    text: Annotated[
        str,
        StringConstraints(strip_whitespace=True, min_length=1, max_length=_SAID),
        AfterValidator(_spelt_out),
    ] = Field(description="What is said.")
    tone: Tone = Field(default="plain", description="How it was said; changes the words' weight.")
    language: Annotated[str, StringConstraints(max_length=20)] | None = Field(
        default=None,
        description="The language, such as `en`, to suppose at first if the words show none.",
    )


class SpeakIn(Message):
    """What the partner is to say aloud; its language is recognised from the text."""

    model_config = _example(text="Somebody is at the door.")

    text: Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=300)] = (
        Field(description="What it says.")
    )


class SenseIn(Message):
    """Something that happened to the partner, as a page noticed it."""

    model_config = _example(kind="stroke", clearness=1.0)

    kind: Kind = Field(description="What happened.")
    clearness: Share = Field(default=1.0, description="How clear or sudden it was.")


class FaceIn(Message):
    """Where in a camera's picture a face is; the picture itself stays in the page."""

    model_config = _example(x=0.5)

    x: Share | None = Field(description="Its middle, 0 (left) to 1 (right); null: nobody.")


class AttendIn(Message):
    """Whose turn it is in the conversation."""

    model_config = _example(turn="listening")

    turn: Turn = Field(
        description="`listening`: somebody is about to speak, or is typing; for 10 s. "
        "`thinking`: they wait for an answer; for 30 s, or until the partner speaks."
    )


class EffortIn(Message):
    """Laban effort values that replace those of a gesture's file."""

    space: Share = Field(description="How far the gesture goes, 0 to 1.")
    weight: Share = Field(description="How strong it is, 0 to 1.")
    time: Share = Field(description="How sudden it is, 0 to 1.")
    flow: Share = Field(description="How freely it flows, 0 to 1.")


class ExpressIn(Message):
    """A gesture to perform once, whatever the feelings are."""

    model_config = _example(feeling="surprise", mood=0.6, blend={"thrill": 0.3})

    feeling: FeelingName = Field(description="The feeling of the main gesture.")
    mood: Share = Field(default=0.7, description="The intensity μ.")
    blend: dict[FeelingName, Share] = Field(
        default_factory=dict,
        description="Other feelings' gestures to mix in, each with its intensity μ.",
    )
    effort: EffortIn | None = Field(default=None, description="null: the gesture's own.")


class LookIn(Message):
    """Where to look, and for how long; ``user`` is straight ahead, ``aside`` looks thoughtful."""

    model_config = _example(at="left", seconds=2.0)

    at: Direction = Field(description="`user` is ahead; `aside` looks thoughtful.")
    seconds: Annotated[float, Field(ge=0, le=30)] = Field(
        default=2.0, description="For how long, s."
    )


class PosesIn(Message):
    """A user's own key poses, written as in a gesture file, to perform once."""

    model_config = _example(
        pose=[
            {
                "phase": 0.5,
                "right": [0.7, 0.5, 0.3],
                "left": [0.7, 0.5, 0.3],
                "head": [0.6, 0.3, 0.74],
            }
        ],
        duration=2.0,
    )

    pose: list[Posture] = Field(
        min_length=1, max_length=32, description="The key poses, in the order of their phases."
    )
    duration: float = Field(
        ge=0.2, le=20, description="Time from neutral to neutral at tempo 1, s.", examples=[2.0]
    )
    effort: EffortIn = Field(
        default=EffortIn(space=1.0, weight=0.5, time=0.5, flow=0.5),
        description="Laban's effort at full intensity.",
    )
    hedge: Literal["plainly", "very", "more or less"] = Field(
        default="plainly", description="How the gesture follows the intensity μ: as μ, μ² or √μ."
    )
    repeat: Repeat | None = Field(default=None, description="A range of poses to play again.")
    mood: Share = Field(default=1.0, description="The intensity μ.")
    feeling: FeelingName | None = Field(
        default=None, description="The feeling that body and face show; null: none."
    )


_Offset = Annotated[
    float, Field(ge=0, le=60, description="When it is due, in s after the performance begins.")
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

    Acts of the body follow one another: each begins when it is due and the one before has ended.
    Sentences run alongside them.
    """

    model_config = _example(
        acts=[
            {"do": "gesture", "feeling": "happiness", "mood": 0.8},
            {"do": "speech", "text": "Look at this!", "offset": 0.5},
        ]
    )

    acts: list[AnyAct] = Field(min_length=1, max_length=20, description="What to do.")
    when: Literal["next", "now"] = Field(
        default="next",
        description="`next`: after what is queued. `now`: in place of what is running and queued.",
    )


class WishOut(BaseModel):
    """A request that was accepted; its events carry this id as `wish`."""

    id: str = Field(description="The wish's id, BOOT:NUMBER.", examples=["5f2c9a10:42"])


class WordsIn(Message):
    """Whether events may contain what people say to the partner."""

    model_config = _example(allowed=False)

    allowed: bool = Field(
        description="false also deletes the words from the stored events.", examples=[False]
    )


class HandIn(Message):
    """A place for the simulated human hand; a null position takes it away."""

    model_config = _example(position=[0.12, -0.11, 0.12], along=[1.0, 0.0, 0.0])

    position: Point | None = Field(description="Middle of the fingers in the base frame, m.")
    along: Point = Field(default=[0.0, 0.0, 1.0], description="The direction of the fingers.")


class BodyIn(Message):
    """The body to change to."""

    model_config = _example(name="simulated")

    name: Name = Field(description="`simulated`, `card` or `emulated-card`.")
    port: Annotated[str, Field(max_length=200)] | None = Field(
        default=None, description="A card's serial port."
    )


class PauseIn(Message):
    """Whether the partner rests at neutral; it still feels, and still stops when touched."""

    model_config = _example(paused=True)

    paused: bool = Field(description="true: rest at neutral; false: go on.")


class TemperamentIn(Message):
    """The temperament to change to."""

    model_config = _example(name="calm", rest="still")

    name: Name = Field(
        description="One that ships with Miburi, or the one that the partner began with."
    )
    rest: RestLevel | None = Field(
        default=None,
        description="How much the partner moves while it shows nothing; default: the temperament's "
        "own.",
    )


class RecordingIn(Message):
    """Whether to start or end a recording."""

    model_config = _example(on=True)

    on: bool = Field(description="true: start one unless one is running; false: end it.")


class GestureOut(BaseModel):
    """The description of a gesture (in the paper: a movement function)."""

    name: str = Field(description="Its name.")
    feeling: TheirFeeling = Field(description="The feeling that it shows.")
    duration: float = Field(description="Duration at tempo 1 without repeats, s.")
    effort: EffortIn = Field(description="Laban's effort at full intensity.")


class BodyOut(BaseModel):
    """A kind of body."""

    name: str = Field(description="Its name.")
    available: bool = Field(description="Whether it can be used on this computer.")
    needs_port: bool = Field(description="Whether it needs a serial port.")
    chosen: bool = Field(description="Whether it is the one that moves now.")


class RecordingOut(BaseModel):
    """A recording; ``whole`` is false until it has ended properly."""

    name: str = Field(description="Its file's name.")
    bytes: int = Field(description="Its size.")
    whole: bool = Field(description="Whether it has ended properly.")


class Refusal(BaseModel):
    """The reason for a refusal, in words."""

    detail: str = Field(description="What was wrong, and what is allowed.")
