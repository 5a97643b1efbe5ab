"""The state of a live partner, as pydantic models that every viewer gets as JSON."""

from enum import StrEnum
from functools import cached_property
from typing import Annotated, Literal

from pydantic import BaseModel, Field

from miburi.bodies import BodyState
from miburi.feelings.catalogue import TheirFeeling
from miburi.feelings.temperament import RestLevel
from miburi.languages import Language
from miburi.partner.rest import Attention
from miburi.robot.guards import Guards
from miburi.safety.stop import StopReason
from miburi.senses.kinds import Distress

Share = Annotated[float, Field(ge=0, le=1)]


Eight = Annotated[list[float], Field(min_length=8, max_length=8)]


#: One value for each of the partner's feelings, in their order.
Levels = list[float]


class Expressed(BaseModel):
    """A feeling that is shown, with the mood as its intensity μ."""

    feeling: TheirFeeling = Field(description="The feeling.")
    mood: Share = Field(description="The mood of that feeling, used as the intensity μ.")


class StopOut(BaseModel):
    """A stop, and what is known about it."""

    time: float = Field(description="Time on the body's clock, s.")
    reason: StopReason = Field(description="A contact, a request, or a fault.")
    motor: str | None = Field(default=None, description="The motor that met something.")
    sign: str | None = Field(
        default=None,
        description="The test of the contact rule that failed: speed, tracking or arrival.",
    )
    ratio: float | None = Field(
        default=None,
        description="The ratio of measured to expected travel: if `sign` is `speed`, in the judged "
        "window, where the rule's limit applies; otherwise since the move began.",
    )
    moved: float | None = Field(default=None, description="The measured travel in that ratio, rad.")
    due: float | None = Field(default=None, description="The expected travel in that ratio, rad.")
    measured: float | None = Field(
        default=None,
        description="Measured speed, rad/s: in the judged window if `sign` is `speed`, at the stop "
        "if it is `tracking`.",
    )
    expected: float | None = Field(
        default=None, description="The commanded speed at that time, rad/s."
    )
    force: float | None = Field(
        default=None,
        description="Largest force on the human hand, N; null if no hand caused the stop. "
        "Simulation only.",
    )
    part: str | None = Field(
        default=None,
        description="The part that met the hand; null if no hand caused the stop. Simulation only.",
    )
    mood_before: Share | None = Field(
        default=None, description="The shown mood before a contact; null for any other stop."
    )
    mood_after: Share | None = Field(
        default=None, description="The same after the contact, which lowers it by 20 %."
    )


#: The notes of a tune, each as [frequency in Hz, duration in s].
Tune = list[Annotated[list[float], Field(min_length=2, max_length=2)]]


class Spoken(BaseModel):
    """A sentence that the partner says aloud; pages whose voice is switched on speak it."""

    number: int = Field(description="A new number means a new sentence.")
    text: str = Field(description="The sentence.")
    language: Language = Field(description="Its code, such as `en`.")
    feeling: TheirFeeling | None = Field(
        description="The partner's feeling then, which colours the voice."
    )
    tune: Tune | None = Field(
        default=None, description="[Hz, s] notes that are played instead of the words."
    )


class DistressOut(BaseModel):
    """Distress that was heard. Miburi is not an alarm and calls nobody."""

    number: int = Field(description="Number of its entry in the log.")
    time: float = Field(description="Time on the body's clock, s.")
    kind: Distress = Field(description="What somebody needs help with.")
    words: str | None = Field(description="What was said, if the user allows events to include it.")


class EndReason(StrEnum):
    """Why a recording ended without a request; the languages' files have the sentences."""

    FULL = "full"
    SLOW = "slow"
    SIZE = "size"
    FOLDER = "folder"
    FAILED = "failed"


class RecordingEnd(BaseModel):
    """A recording that ended by itself."""

    name: str = Field(description="Its file.")
    reason: EndReason = Field(description="Why it ended.")
    detail: str = Field(description="The system's message.")


class RuleOut(BaseModel):
    """The period and the limit of the contact rule in force (Eqs. 1 and 2)."""

    period: float = Field(description="p, s.")
    ratio: float = Field(description="The limit on measured over expected travel.")


class Hand(BaseModel):
    """The simulated human hand's pose."""

    position: list[float] = Field(description="Position in the base frame, m.")
    quaternion: list[float] = Field(description="w, x, y, z.")


class State(BaseModel):
    """The partner at one moment; arrays follow the order in ``GET /robot``."""

    serial: int = Field(description="Counts up by one at each step.")
    time: float = Field(description="Time on the body's clock, s.")
    body: str = Field(description="The kind of body.")
    phase: Literal["idle", "moving", "stopped", "returning"] = Field(
        description="What the body does."
    )
    paused: bool = Field(description="Whether it rests at neutral until somebody lets it go on.")
    temperament: str = Field(description="The present one.")
    rest: RestLevel = Field(description="How much the partner moves while it shows no feeling.")
    recording: str | None = Field(description="The file of the present recording.")
    recording_end: RecordingEnd | None = Field(
        description="Why the latest recording ended by itself; null when another begins."
    )
    angles: Eight = Field(description="rad")
    velocities: Eight = Field(description="rad/s")
    emotion: Levels = Field(description="The fast level, 0 to 1.")
    feeling: Levels = Field(description="The middle level, 0 to 1.")
    mood: Levels = Field(description="The slow level, 0 to 1.")
    felt: Expressed | None = Field(description="The strongest emotion, with its mood.")
    expressed: Expressed | None = Field(description="The present gesture; null between gestures.")
    asked: bool = Field(description="Whether somebody asked for the present gesture.")
    hand_speed: float = Field(description="Mean speed of both hands in the last 0.1 s, m/s.")
    extent: float = Field(description="The larger of the two hands' distances from neutral, m.")
    ratios: list[float | None] = Field(
        description="Each motor's ratio of measured to expected travel in the latest window; null "
        "if it is not judged. A card reports only the ratio of the motor that caused the stop."
    )
    rule: RuleOut = Field(description="The contact rule in force.")
    stop: StopOut | None = Field(description="Why the body is stopped; null while it is not.")
    held: bool = Field(
        description="Whether somebody pressed Stop, so that the body waits for a release."
    )
    force: float | None = Field(description="Force on the human hand now, N; simulation only.")
    hand: Hand | None = Field(description="The simulated human hand; null on a card.")
    hand_out: bool = Field(
        description="Whether the simulated hand is being guided; otherwise it waits beside the "
        "table."
    )
    face: Levels = Field(description="How much of each feeling the face shows.")
    spoken: Spoken | None = Field(description="The latest sentence that it says.")
    attention: Attention | None = Field(
        default=None, description="Its part in a conversation; null without one."
    )
    eyes: tuple[float, float] = Field(
        default=(0.0, 0.0),
        description="Where the eyes look, to the face's right and down, -1 to 1. They move before "
        "the head, and return to the middle as it follows.",
    )
    distress: DistressOut | None = Field(
        default=None, description="The latest distress, for ten minutes after it was heard."
    )
    words: bool = Field(
        description="Whether the user allows events to include what people say to the partner."
    )
    boot: str = Field(description="The id of this start of the partner.")
    latest: int = Field(
        description="Number of the latest event; `boot:latest` is the cursor of a client that "
        "is up to date."
    )

    @property
    def cursor(self) -> str:
        """Return the cursor of a client that has all events up to now."""
        return f"{self.boot}:{self.latest}"


class Sample(BaseModel):
    """One moment of the last minutes, for plots."""

    time: float = Field(description="Time on the body's clock, s.")
    mood: Levels = Field(description="The moods.")
    hand_speed: float = Field(description="Mean speed of both hands, as in the state, m/s.")
    extent: float = Field(
        description="The larger of the two hands' distances from neutral, as in the state, m."
    )
    ratios: list[float | None] = Field(description="As in the state.")
    stopped: bool = Field(description="Whether the body was stopped.")

    @classmethod
    def of(cls, state: State) -> "Sample":
        """Return the sample of a state."""
        return cls(
            time=state.time,
            mood=state.mood,
            hand_speed=state.hand_speed,
            extent=state.extent,
            ratios=state.ratios,
            stopped=state.stop is not None,
        )


class MotorOut(BaseModel):
    """One motor; null for what the body does not report."""

    joint: str = Field(description="The joint that it turns.")
    servo: int | None = Field(description="The servo's id on the bus.")
    answers: bool | None = Field(description="Whether it answers on the bus.")
    temperature: float | None = Field(description="°C")
    voltage: float | None = Field(description="V")
    guards: Guards[float] = Field(description="The contact rule's tolerances for this motor.")


class MotorsOut(BaseModel):
    """The motors' health and calibration."""

    body: str = Field(description="The kind of body.")
    port: str | None = Field(description="A card's serial port.")
    calibrated: bool = Field(
        description="Whether the tolerances differ from those that ship with the robot."
    )
    settings: str | None = Field(description="The checksum of a card's settings.")
    hottest: float | None = Field(description="Temperature above which a motor stops the body, °C.")
    lowest: float | None = Field(description="Supply voltage below which the body is stopped, V.")
    rule: RuleOut = Field(description="The contact rule in force.")
    motors: list[MotorOut] = Field(description="Each motor, in the order of the joints.")


class Snapshot:
    """A state as an object and as JSON; the form that is not given is made once, when needed."""

    def __init__(self, state: State | None = None, json: str = "", serial: int = -1) -> None:
        self._given, self._json = state, json
        #: The state's serial number, which is known even before the JSON is parsed.
        self.serial = serial if state is None else state.serial

    @cached_property
    def state(self) -> State:
        """The state as an object."""
        return self._given or State.model_validate_json(self._json)

    @cached_property
    def json(self) -> str:
        """The state as JSON."""
        return self._json or self.state.model_dump_json()

    def at_least(self, serial: int, body: BodyState, held: bool, latest: int) -> "Snapshot":
        """Return a copy; update the fields that must be right even if the observer fails."""
        update = {
            "serial": serial,
            "time": round(body.time, 3),
            "phase": body.phase.value,
            "held": held,
            "latest": latest,
        }
        return Snapshot(self.state.model_copy(update=update))

    def halted(self) -> "Snapshot":
        """Return a copy with a stop by the watchdog because the loop was late."""
        if self.state.phase == "stopped":
            return self
        stop = StopOut(time=self.state.time, reason=StopReason.LOOP_LATE)
        return Snapshot(self.state.model_copy(update={"phase": "stopped", "stop": stop}))
