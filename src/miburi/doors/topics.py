"""The MQTT messages of a partner and their topics: its state, stops, and distress."""

from pydantic import BaseModel, Field

from miburi.live.events.event import Wall
from miburi.live.state import MotorsOut, State
from miburi.safety.stop import StopReason
from miburi.senses.kinds import Distress

#: The feeling that is reported if none is strong enough.
NEUTRAL = "neutral"
#: The name under which all partners listen for Stop.
ALL = "all"


class Topics:
    """The topics of one partner; the name ``+`` stands for every partner.

    A partner in a group is named ``GROUP/NAME``.
    """

    def __init__(self, name: str) -> None:
        base = f"miburi/{name}"
        self.available, self.report = f"{base}/available", f"{base}/report"
        self.stops, self.refused = f"{base}/stops", f"{base}/refused"
        self.distress, self.gaps = f"{base}/distress", f"{base}/gaps"
        self.feel, self.say, self.stop = f"{base}/feel", f"{base}/say", f"{base}/stop"
        #: The topics to ask whether a partner has this name, and for its answer.
        self.who, self.here = f"{base}/who", f"{base}/here"


class HomeReport(BaseModel):
    """A partner's state; retained, so that clients that connect later get it, too."""

    feeling: str = Field(description="The strongest feeling, or neutral.")
    mood: int = Field(description="Its mood, %.")
    paused: bool
    stopped: StopReason | None = Field(description="Why the body is stopped; null while it is not.")
    motor: str | None = Field(
        description="The motor that met something, was moved or failed, if it is one."
    )
    held: bool = Field(description="Whether it waits for a person to release it.")
    stops_today: int = Field(description="Stops since midnight, or since the partner woke.")
    temperatures: dict[str, float] = Field(
        description="Temperatures of the motors, where reported, °C."
    )
    studio: str | None = Field(
        default=None, description="The address of its pages for other devices."
    )
    wall: Wall | None = Field(default=None, description="The time of this report, UTC.")
    version: str | None = Field(default=None, description="The version of Miburi that runs.")
    since: Wall | None = Field(default=None, description="When it began to run, UTC.")
    ended: bool = Field(
        default=False,
        description="Whether it was switched off; a partner that is gone without it was lost.",
    )


class StopNews(BaseModel):
    """A stop. It may arrive more than once, with the same id."""

    event_type: StopReason
    id: str = Field(description="BOOT:NUMBER, unique even across restarts.")
    wall: Wall = Field(description="When, UTC.")
    motor: str | None
    force: float | None = Field(description="Force on the hand, N; in the simulation only.")


class DistressNews(BaseModel):
    """Distress that the partner has heard.

    It is not an alarm to rely on: it can be false, or missing.
    """

    event_type: Distress
    id: str = Field(description="BOOT:NUMBER, unique even across restarts.")
    wall: Wall = Field(description="When, UTC.")
    words: str | None = Field(description="What was said, if the user lets others hear it.")


class GapNews(BaseModel):
    """Some events before the next one are missing: the partner does not have them any more."""

    id: str = Field(description="BOOT:NUMBER after which the stream goes on.")
    wall: Wall = Field(description="When, UTC.")
    why: str


def make_report(state: State, motors: MotorsOut, studio: str | None = None) -> HomeReport:
    """Return the report of a state; the caller fills in ``stops_today``."""
    stop, felt = state.stop, state.felt
    return HomeReport(
        feeling=NEUTRAL if felt is None else felt.feeling,
        mood=0 if felt is None else round(100 * felt.mood),
        paused=state.paused,
        stopped=None if stop is None else stop.reason,
        motor=None if stop is None else stop.motor,
        held=state.held,
        stops_today=0,
        studio=studio,
        temperatures={
            motor.joint: motor.temperature
            for motor in motors.motors
            if motor.temperature is not None
        },
    )
