"""The answers for agents, in words and as data."""

from typing import Any

from pydantic import BaseModel, Field

from miburi.live.events.event import LiveEvent
from miburi.live.state import Expressed, State, StopOut
from miburi.safety.stop import StopReason


class _Shown(BaseModel):
    """A feeling, and the mood at which it shows, 0 to 1."""

    feeling: str
    mood: float


class Now(BaseModel):
    """The partner's state, as an agent sees it."""

    feels: _Shown | None
    shows: _Shown | None
    asked: bool = Field(description="Whether somebody asked for what it shows")
    said: str | None
    distress: str | None = Field(description="Distress that it heard")
    body: str = Field(description="idle, moving, stopped or returning")
    paused: bool
    stopped: str | None = Field(description="Why it stopped, and how that ends")
    latest_event: str


def without_titles(schema: Any) -> Any:
    """Return a schema without Pydantic's titles."""
    if isinstance(schema, dict):
        return {name: without_titles(part) for name, part in schema.items() if name != "title"}
    return [without_titles(part) for part in schema] if isinstance(schema, list) else schema


def left_of(stop: StopOut, begun: bool) -> str:
    """Return the effect of a stop on a gesture, in words."""
    if begun:
        return "was broken off"
    dropped = stop.reason is StopReason.ASKED
    return "was dropped" if dropped else "has not begun; it waits for the release"


def as_shown(shown: Expressed | None) -> _Shown | None:
    """Return a feeling with its mood, for an agent."""
    return None if shown is None else _Shown(feeling=shown.feeling, mood=round(shown.mood, 2))


def passes_by_itself(state: State, stop: StopOut) -> bool:
    """Whether a stop ends without a person."""
    return stop.reason.passes and not state.held


def hindrance(state: State) -> str:
    """Return why the body does not show a feeling now; empty if it can."""
    if state.stop is not None:
        return " " + why_stopped(state, state.stop)
    return " Its body does not show that: it is paused." if state.paused else ""


def why_stopped(state: State, stop: StopOut) -> str:
    """Return why the body is stopped, and how that ends."""
    ends = (
        "It goes on by itself after a pause."
        if passes_by_itself(state, stop)
        else "Only a person can release it."
    )
    return f"The body is stopped: {_reason(stop)}. {ends}"


def _reason(stop: StopOut) -> str:
    match stop.reason:
        case StopReason.CONTACT:
            motor = (stop.motor or "a motor").replace("_", " ")
            force = "" if stop.force is None else f" with {stop.force:.1f} N"
            return f"its {motor} met something{force}"
        case StopReason.ASKED:
            return "somebody asked for it"
        case StopReason.TOUCHED:
            return f"somebody is moving its {(stop.motor or 'body').replace('_', ' ')} by hand"
        case reason:
            return reason.spoken


def as_line(event: LiveEvent) -> str:
    """Return an event as one line of text."""
    about = [f"{event.id} ({event.wall:%Y-%m-%d %H:%M:%S} UTC) {event.kind}"]
    if event.stop is not None:
        about.append(_reason(event.stop))
    elif event.feeling is not None:
        amount = event.mood if event.strength is None else event.strength
        about.append(event.feeling if amount is None else f"{event.feeling} {amount:.2f}")
    elif event.name is not None:
        about.append(event.name)
    about += [f'"{event.text}"'] if event.text else []
    about += [text for text in (event.source, event.detail, event.by) if text]
    return ": ".join([about[0], ", ".join(about[1:])] if len(about) > 1 else about)
