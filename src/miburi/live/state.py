"""The state of a live partner as every viewer sees it."""

from typing import Annotated, Literal

from pydantic import BaseModel, Field

from miburi.feelings.catalogue import FEELINGS, FeelingName
from miburi.live.archive import EndReason
from miburi.robot.guards import Guards
from miburi.safety.stop import StopReason

__all__ = [
    "Eight",
    "Entry",
    "Expressed",
    "Hand",
    "Levels",
    "MotorOut",
    "MotorsOut",
    "RecordingEnd",
    "RuleOut",
    "Sample",
    "Share",
    "State",
    "StopOut",
]

Share = Annotated[float, Field(ge=0, le=1)]


Eight = Annotated[list[float], Field(min_length=8, max_length=8)]


Levels = Annotated[list[float], Field(min_length=len(FEELINGS), max_length=len(FEELINGS))]


class Expressed(BaseModel):
    """What the body shows, with the mood as its intensity μ."""

    feeling: FeelingName
    mood: Share


class StopOut(BaseModel):
    """A stop that holds now, and what is known about it."""

    time: float = Field(description="s on the body's clock.")
    reason: StopReason = Field(description="A contact, somebody who asked, or what failed.")
    motor: str | None = Field(description="The motor that met something.")
    sign: str | None = Field(description="speed, tracking or arrival: what gave the contact away.")
    ratio: float | None = Field(
        description="Measured over expected travel: with the sign speed in the judged window, "
        "which the rule's limit is for; else since the move began."
    )
    moved: float | None = Field(description="The measured travel, rad, that the ratio is of.")
    due: float | None = Field(description="The expected travel, rad, that the ratio is of.")
    measured: float | None = Field(
        description="Speed, rad/s: with the sign speed in the judged window, with tracking at the "
        "stop."
    )
    expected: float | None = Field(description="Speed that was commanded for the same, rad/s.")
    force: float | None = Field(description="Largest force on the human hand, N; simulation only.")
    part: str | None = Field(description="The part that was touched; simulation only.")
    mood_before: Share
    mood_after: Share


class RecordingEnd(BaseModel):
    """A recording that ended by itself."""

    name: str
    reason: EndReason
    detail: str = Field(description="What the system said.")


class RuleOut(BaseModel):
    """What the contact rule that runs compares (Eqs. 1 and 2)."""

    period: float = Field(description="p, s.")
    ratio: float = Field(description="The limit on measured over expected travel.")


class Hand(BaseModel):
    """The simulated human hand's pose."""

    position: list[float]
    quaternion: list[float]


class State(BaseModel):
    """Everything that a viewer needs at one moment; arrays follow the order of ``GET /robot``."""

    serial: int = Field(description="Counts up by one at each step.")
    time: float = Field(description="s on the body's clock.")
    body: str
    phase: Literal["idle", "moving", "stopped", "returning"]
    paused: bool
    temperament: str
    recording: str | None = Field(description="The file that is being written.")
    recording_end: RecordingEnd | None = Field(
        description="Why the latest recording ended by itself; null once another begins."
    )
    angles: Eight = Field(description="rad")
    velocities: Eight = Field(description="rad/s")
    emotion: Levels
    feeling: Levels
    mood: Levels
    felt: Expressed | None = Field(description="The strongest emotion, with its mood.")
    expressed: Expressed | None = Field(description="The gesture of now; null between gestures.")
    asked: bool = Field(description="Whether somebody asked for that gesture.")
    hand_speed: float = Field(description="Mean speed of both hands in the last 0.1 s, m/s.")
    extent: float = Field(description="Distance of the further hand from its neutral place, m.")
    ratios: list[float | None] = Field(
        description="Measured over expected travel in the latest window; null if not judged. "
        "A card tells it for the motor that stopped it alone."
    )
    rule: RuleOut
    stop: StopOut | None
    held: bool = Field(description="Whether a person stopped it: it waits for a release.")
    force: float | None = Field(description="Force on the human hand now, N; simulation only.")
    hand: Hand | None
    hand_out: bool = Field(description="Whether the hand reaches out, or waits beside the table.")
    face: Levels = Field(description="How much of each feeling the face shows.")
    latest: int = Field(description="Number of the latest entry of the log.")


class Entry(BaseModel):
    """One line of the log; only what belongs to its kind is given."""

    number: int
    time: float
    kind: Literal[
        "stimulus", "gesture", "stopped", "released", "body", "paused", "resumed", "temperament",
        "recording", "recorded", "recording_ended", "deleted", "refused",
        "trouble",
    ]  # fmt: skip
    feeling: str | None = None
    mood: float | None = None
    strength: float | None = None
    source: str | None = None
    name: str | None = None
    reason: EndReason | None = Field(default=None, description="Why a recording ended by itself.")
    detail: str | None = None
    stop: StopOut | None = None
    limit: float | None = Field(default=None, description="The rule's limit at that stop.")


class Sample(BaseModel):
    """A moment of the last minutes, for plots."""

    time: float
    mood: Levels
    hand_speed: float
    extent: float
    ratios: list[float | None]
    stopped: bool


class MotorOut(BaseModel):
    """One motor; what a body does not tell is null."""

    joint: str
    servo: int | None = Field(description="The servo's id on the bus.")
    answers: bool | None
    temperature: float | None = Field(description="°C")
    voltage: float | None = Field(description="V")
    guards: Guards[float] = Field(description="What the contact rule grants it.")


class MotorsOut(BaseModel):
    """How the motors are, and what they were calibrated to."""

    body: str
    port: str | None
    calibrated: bool = Field(
        description="Whether the guards are other than those that ship with the robot."
    )
    settings: str | None = Field(description="The check sum of what a card knows of the body.")
    hottest: float | None = Field(description="A hotter motor stops the body, °C.")
    lowest: float | None = Field(description="A lower supply stops the body, V.")
    rule: RuleOut
    motors: list[MotorOut]
