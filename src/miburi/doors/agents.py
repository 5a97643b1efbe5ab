"""The interface for agents: MCP tools for feelings and gestures, without control of joints.

An agent can make the partner feel something, ask it for a gesture, and see what happens. It can
stop the body but not release it: only a person can. Only the latest of several wishes counts; they
do not queue up. If the paused or stopped body refuses a wish, the tool returns an error with the
reason. If a gesture is broken off, the tool says so in its answer.

The tools use an :class:`~miburi.client.asker.Asker`, so they work inside the server, at ``/mcp``,
and over standard input and output, as ``miburi mcp``, which forwards requests to a server.

This module needs the extra ``mcp``.
"""

import asyncio
import json
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from functools import wraps
from typing import Annotated, Any, Concatenate, Literal, ParamSpec, TypeVar

from fastapi import FastAPI
from pydantic import Field, ValidationError

from miburi.client.asker import Asker
from miburi.doors.agents_words import (
    Now,
    as_line,
    as_shown,
    hindrance,
    left_of,
    passes_by_itself,
    why_stopped,
    without_titles,
)
from miburi.errors import BodyError, InputError, MiburiError, needs_extra
from miburi.feelings.catalogue import FeelingName
from miburi.gestures import Direction
from miburi.live.events.event import LiveEvent
from miburi.live.state import Share, StopOut
from miburi.partner import LAPSES
from miburi.safety.stop import StopReason
from miburi.serving.access import AGENTS
from miburi.serving.allowance import Allowance
from miburi.serving.beside import beside
from miburi.version import __version__
from miburi.wire.messages import ExpressIn, LookIn, SpeakIn, StimulusIn

try:
    from mcp.server import MCPServer
    from mcp.server.mcpserver.exceptions import ToolError
    from mcp.server.mcpserver.tools import Tool
    from mcp.server.transport_security import TransportSecuritySettings
    from mcp.types import ToolAnnotations
except ModuleNotFoundError as error:
    raise needs_extra("mcp", error) from error


#: Wishes per second, and in a burst, from all agents together (our choice).
RATE, BURST = 2.0, 8.0
#: The time between two checks of a gesture, and how long an agent waits for its end, in s (our
#: choice).
_GLANCE, _PATIENCE = 0.1, 25.0
#: The most events in one answer.
_TOLD = 40

_INSTRUCTIONS = """\
A small robot partner with feelings that show in its body. Its own temperament scales how strongly
it feels what you send; `gesture` shows something once, whatever it feels. It stops by itself when
it touches somebody. After a stop, only a person can release it: tell people why it stopped and
wait. Of several requests the latest counts. If it has heard distress, somebody may need help now.
It calls nobody, so tell people if you can, and use only calm gestures for ten minutes. Do not hurry
it: a gesture takes a few seconds."""
_TOO_FAST = "Nothing was done: too many requests at once. Wait a second, then ask again."
_WAITS = f"waits for up to {LAPSES:g} s; any newer gesture or look replaces it."
_PAUSED = "It is paused; your gesture waits until somebody resumes it."
#: Why a gesture did not begin.
_DROPPED = {
    "lapsed": "It lapsed: the body was stopped for too long.",
    "stopped": "Somebody pressed Stop before it began.",
}
_REPLACED = "It did not begin: a newer wish has taken its place."

Parameters = ParamSpec("Parameters")
Answer = TypeVar("Answer")
Strength = Annotated[Share, Field(description="0 to 1")]
#: The tools, in the order in which an agent sees them, and whether each only reads. Hints that
#: repeat MCP's defaults are left out, because a model may read every word of them.
_TOOLS = {
    "feel": False,
    "say": False,
    "gesture": False,
    "look": False,
    "think": False,
    "stop": False,
    "state": True,
    "events": True,
}


class _StrictTool(Tool):
    """A tool that rejects unknown arguments, with an error message free of links."""

    @classmethod
    def of(cls, work: Callable[..., Awaitable[object]]) -> Tool:
        name = work.__name__
        reads = ToolAnnotations(read_only_hint=True)
        tool = cls.from_function(
            work,
            title=name.capitalize(),
            annotations=reads if _TOOLS[name] else ToolAnnotations(destructive_hint=False),
            structured_output=name == "state",
        )
        arguments = tool.fn_metadata.arg_model
        arguments.model_config["extra"] = "forbid"
        arguments.model_rebuild(force=True)
        tool.parameters = without_titles(arguments.model_json_schema())
        if tool.fn_metadata.output_schema is not None:
            tool.fn_metadata.output_schema = without_titles(tool.fn_metadata.output_schema)
        return tool

    async def run(self, arguments: dict[str, Any], *args: Any, **kwargs: Any) -> Any:
        """Check the arguments, and run the tool."""
        try:
            self.fn_metadata.validate_arguments(arguments)
        except ValidationError as error:
            known = ", ".join(self.fn_metadata.arg_model.model_fields) or "no arguments"
            wrong = "; ".join(
                f"{'.'.join(str(part) for part in one['loc'])}: {one['msg']}"
                for one in error.errors(include_url=False)
            )
            raise ToolError(f"{wrong}. {self.name} takes {known}.") from error
        return await super().run(arguments, *args, **kwargs)


def make_agents(partner: Asker, clock: Callable[[], float] = time.monotonic) -> MCPServer:
    """Return the server of tools and resources, not yet on a transport; ``clock`` returns s."""
    tools = _Tools(partner, Allowance(RATE, BURST, clock))
    server = MCPServer(
        "miburi",
        instructions=_INSTRUCTIONS,
        version=__version__,
        log_level="CRITICAL",
        tools=[_StrictTool.of(getattr(tools, name)) for name in _TOOLS],
    )

    async def state() -> str:
        return (await tools.state()).model_dump_json()

    json_text = "application/json"
    server.resource("miburi://state", name="state", mime_type=json_text)(state)
    server.resource("miburi://gestures", name="gestures", mime_type=json_text)(tools.gestures)
    return server


def add_agents(app: FastAPI, clock: Callable[[], float] = time.monotonic) -> None:
    """Serve agents at ``/mcp`` while the server runs."""
    server = make_agents(Asker.within(app, "agent"), clock)
    inner = server.streamable_http_app(
        streamable_http_path=AGENTS,
        stateless_http=True,
        json_response=True,
        # Our gate has already checked Host and Origin.
        transport_security=TransportSecuritySettings(enable_dns_rebinding_protection=False),
    )
    app.router.routes.extend(inner.routes)

    @asynccontextmanager
    async def serving() -> AsyncIterator[None]:
        async with server.session_manager.run():
            yield

    beside(app, serving)


def _in_words(
    work: Callable[Parameters, Awaitable[Answer]],
) -> Callable[Parameters, Awaitable[Answer]]:
    @wraps(work)
    async def answer(*args: Parameters.args, **kwargs: Parameters.kwargs) -> Answer:
        try:
            return await work(*args, **kwargs)
        except InputError as error:
            raise ToolError(str(error)) from error
        except MiburiError as error:
            raise ToolError(f"Nothing was done: {error}") from error

    return answer


def _wish(
    work: Callable[Concatenate["_Tools", Parameters], Awaitable[str]],
) -> Callable[Concatenate["_Tools", Parameters], Awaitable[str]]:
    """Limit the rate of wishes; a refusal is a tool's error, with its reason in words."""

    @wraps(work)
    async def answer(
        tools: "_Tools", /, *args: Parameters.args, **kwargs: Parameters.kwargs
    ) -> str:
        if not tools.wishes.take("all"):
            raise ToolError(_TOO_FAST)
        try:
            return await work(tools, *args, **kwargs)
        except BodyError as error:
            raise ToolError(f"Nothing was done: {error} Only a person can do that.") from error

    return _in_words(answer)


class _Tools:
    """The tools; agents read each docstring as a description."""

    def __init__(self, partner: Asker, wishes: Allowance) -> None:
        self._partner, self.wishes = partner, wishes

    @_wish
    async def feel(self, feeling: FeelingName, strength: Strength = 0.7) -> str:
        """Make the partner feel something; its temperament decides how much it shows."""
        await self._partner.tell("/stimulus", StimulusIn(feeling=feeling, strength=strength))
        state = await self._partner.state()
        return f"It feels {feeling}.{hindrance(state)}"

    @_wish
    async def gesture(self, feeling: FeelingName, intensity: Strength = 0.7) -> str:
        """Show a feeling's gesture once and wait for its end, or say why it stopped."""
        before = await self._partner.state()
        wish = await self._partner.wish("/express", ExpressIn(feeling=feeling, mood=intensity))
        if before.stop is not None and not passes_by_itself(before, before.stop):
            return f"{why_stopped(before, before.stop)} Your gesture {_WAITS}"
        return await self._follow(wish, feeling)

    @_wish
    async def say(self, words: Annotated[str, Field(min_length=1, max_length=300)]) -> str:
        """Have the partner say something; it is shown, and heard on pages with the voice on."""
        await self._partner.tell("/speak", SpeakIn(text=words))
        return "It is saying that."

    @_wish
    async def look(self, at: Literal["user", "left", "right", "up", "down"]) -> str:
        """Have the partner look somewhere for two seconds; `user` is straight ahead."""
        return await self._look(at, 2.0, f"It looks {'ahead' if at == 'user' else at}.")

    @_wish
    async def think(self, on: bool) -> str:
        """Show people that you are thinking, for 30 s or until your next wish; false ends it."""
        if on:
            return await self._look("aside", 30.0, "It looks thoughtful.")
        return await self._look("user", 0.0, "It looks ahead.")

    @_in_words
    async def stop(self) -> str:
        """Stop all motors at once. Only a person can release them."""
        await self._partner.tell("/stop")
        return "It is stopped. Only a person can release it."

    @_in_words
    async def state(self) -> Now:
        """Return what the partner feels and shows, and whether and why it is paused or stopped."""
        state = await self._partner.state()
        return Now(
            feels=as_shown(state.felt),
            shows=as_shown(state.expressed),
            asked=state.asked,
            said=None if state.spoken is None else state.spoken.text,
            distress=None if state.distress is None else state.distress.kind,
            body=state.phase,
            paused=state.paused,
            stopped=None if state.stop is None else why_stopped(state, state.stop),
            latest_event=f"{state.boot}:{state.latest}",
        )

    @_in_words
    async def events(
        self, since: Annotated[str, Field(pattern=r"^[0-9a-f:]{0,24}$", max_length=24)] = ""
    ) -> str:
        """List events after `since`, such as words and stops; earlier runs too."""
        events = await self._partner.log(since or None)
        told = events[:_TOLD] if since else events[-_TOLD:]
        lines = [as_line(event) for event in told]
        if left := len(events) - len(told):
            more = f"{left} earlier ones"
            if since:
                more = f"{left} more; call again with since={told[-1].id}"
            lines.append(f"({more})")
        return "\n".join(lines) or f"Nothing has happened after event {since}."

    @_in_words
    async def gestures(self) -> str:
        """Return the gestures with their feelings and durations."""
        gestures = await self._partner.gestures()
        shown = ("name", "feeling", "duration")
        return json.dumps([gesture.model_dump(include={*shown}) for gesture in gestures])

    async def _look(self, at: Direction, seconds: float, told: str) -> str:
        await self._partner.tell("/look", LookIn(at=at, seconds=seconds))
        state = await self._partner.state()
        if state.stop is not None:
            return f"{why_stopped(state, state.stop)} The look {_WAITS}"
        return told

    async def _follow(self, wish: str, feeling: str) -> str:
        """Wait until the requested gesture has ended; return how it ended."""
        begun, since, stop = False, wish, None
        for _ in range(round(_PATIENCE / _GLANCE)):
            for event in await self._partner.log(since):
                since = event.id
                ours = event.wish == wish
                match event.kind:
                    case "stop" if event.stop is not None:
                        stop = event.stop
                        if not begun and stop.reason is not StopReason.ASKED:
                            state = await self._partner.state()
                            return (
                                f"{why_stopped(state, stop)} Your gesture {left_of(stop, begun)}."
                            )
                    case "paused" if not begun:
                        return _PAUSED
                    case "gesture_begun" if ours:
                        begun = True
                    case "gesture_ended" if ours:
                        return f"It has shown {feeling}."
                    case "gesture_broken_off" | "wish_dropped" if ours:
                        return await self._ending(event, stop, begun)
            await asyncio.sleep(_GLANCE)
        return f"It has not {'ended' if begun else 'begun'} after {_PATIENCE:g} s; ask `state`."

    async def _ending(self, event: LiveEvent, stop: StopOut | None, begun: bool) -> str:
        state = await self._partner.state()
        stop = stop or state.stop
        if stop is not None and event.name not in ("lapsed", "replaced"):
            return f"{why_stopped(state, stop)} Your gesture {left_of(stop, begun)}."
        if event.kind == "wish_dropped":
            return _DROPPED.get(event.name or "", _REPLACED)
        return "It was broken off."
