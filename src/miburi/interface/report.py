"""What a partner tells its home over MQTT: topics, a report of how it is, stops, distress."""

from pydantic import BaseModel, Field

from miburi.live.state import MotorsOut, State, StopOut
from miburi.safety.stop import StopReason
from miburi.senses.kinds import Distress

__all__ = [
    "ALL",
    "NEUTRAL",
    "DistressNews",
    "HomeReport",
    "StopNews",
    "Topics",
    "make_report",
    "make_stop_news",
]

#: The feeling of a partner that feels nothing strongly.
NEUTRAL = "neutral"
#: The name under which all partners listen to Stop.
ALL = "all"


class Topics:
    """The topics of one partner; ``+`` as a name means those of every partner."""

    def __init__(self, name: str) -> None:
        base = f"miburi/{name}"
        self.available, self.report = f"{base}/available", f"{base}/report"
        self.stops, self.refused = f"{base}/stops", f"{base}/refused"
        self.distress = f"{base}/distress"
        self.feel, self.say, self.stop = f"{base}/feel", f"{base}/say", f"{base}/stop"
        #: Here somebody asks who lives under this name, and there the partner says so.
        self.who, self.here = f"{base}/who", f"{base}/here"


class HomeReport(BaseModel):
    """How a partner is; retained, so that who comes later knows it, too."""

    feeling: str = Field(description="The strongest feeling, or neutral.")
    mood: int = Field(description="Its mood, %.")
    body: str
    paused: bool
    stopped: StopReason | None = Field(description="Why the body is stopped; null while it is not.")
    motor: str | None = Field(description="The motor that met something.")
    held: bool = Field(description="Whether it waits for a person to release it.")
    stops_today: int = Field(description="Stops since midnight, or since the partner woke.")
    temperatures: dict[str, float] = Field(description="°C, of the motors that report one.")


class StopNews(BaseModel):
    """A stop; who gets the same number twice has heard of it before."""

    event_type: StopReason
    number: int = Field(description="In the log of a partner that is awake.")
    motor: str | None
    force: float | None = Field(description="On the hand, N; simulation only.")


class DistressNews(BaseModel):
    """A distress that the partner has heard; it is no alarm, and may be wrong or missing."""

    event_type: Distress
    number: int = Field(description="In the log of a partner that is awake.")
    words: str | None = Field(description="What was said, if the user lets others hear it.")


def make_report(state: State, motors: MotorsOut, stops_today: int) -> HomeReport:
    """Return the report of a state."""
    stop, felt = state.stop, state.felt
    return HomeReport(
        feeling=NEUTRAL if felt is None else felt.feeling,
        mood=0 if felt is None else round(100 * felt.mood),
        body=state.phase,
        paused=state.paused,
        stopped=None if stop is None else stop.reason,
        motor=None if stop is None else stop.motor,
        held=state.held,
        stops_today=stops_today,
        temperatures={
            motor.joint: motor.temperature
            for motor in motors.motors
            if motor.temperature is not None
        },
    )


def make_stop_news(number: int, stop: StopOut) -> StopNews:
    """Return the news of a stop in the log."""
    return StopNews(event_type=stop.reason, number=number, motor=stop.motor, force=stop.force)
