"""The WebSocket ``/api/v1/live``: it sends events, and states at a chosen rate, and takes commands.

Each viewer has its own tasks and its own rate: at 50 a second it gets every step, and at lower
rates the latest state. A slow viewer misses states, and a dead viewer is dropped; neither the
partner nor other viewers wait for such a viewer. :mod:`miburi.serving.http` tells how far a viewer
has read. Events are never missed: see :mod:`miburi.interface.events`. A Stop does not wait for
earlier commands of the same viewer, and cancels the commands that still wait.
"""

import asyncio
import json
import time
from collections.abc import AsyncIterator
from contextlib import suppress
from typing import Annotated, Literal, get_args

from fastapi import APIRouter, Query, WebSocket, WebSocketDisconnect
from pydantic import Field, TypeAdapter, ValidationError

from miburi.errors import InputError, MiburiError
from miburi.feelings import Stimulus
from miburi.interface.api import move_hand
from miburi.interface.events import follow
from miburi.interface.refusing import known_queries
from miburi.live.commands import BusyError
from miburi.live.events.event import Cursor, LiveEvent
from miburi.live.runner import STEP
from miburi.live.settle import granted
from miburi.live.view import LivePartner
from miburi.live.wishes import Feel, Release
from miburi.serving.press import By, press, who
from miburi.wire.messages import FASTEST, SLOWEST, HandIn, Message, Rate, StimulusIn

_RATE = TypeAdapter[float](Rate)
#: A viewer that accepts no state for this long, s, counts as disconnected.
PATIENCE = 5.0
#: A viewer that sends more invalid messages than this is disconnected.
MISTAKES = 20
#: The largest message, in characters.
LARGEST = 2_000
#: How many of a viewer's commands may wait; further ones are dropped.
_WAITING = 64
_POLICY, _BYE = 1008, 1001
#: How many characters the reason for closing may have; the protocol allows 123.
_REASON = 120


class HandMessage(HandIn):
    """Move the hand."""

    do: Literal["hand"]


class StimulusMessage(StimulusIn):
    """Let the partner feel something."""

    do: Literal["stimulus"]


class StopMessage(Message):
    """Stop all motors; ``by`` is as in the header of ``POST /stop``.

    A page also sends each Stop over HTTP; ``press`` is its id, by which the second copy is
    recognised.
    """

    do: Literal["stop"]
    by: str = "person"
    press: str = ""


class ReleaseMessage(Message):
    """Release a stopped body."""

    do: Literal["release"]


class RateMessage(Message):
    """Send ``rate`` states a second from now on."""

    do: Literal["rate"]
    rate: Rate


AnyMessage = Annotated[
    HandMessage | StimulusMessage | StopMessage | ReleaseMessage | RateMessage,
    Field(discriminator="do"),
]
_MESSAGE: TypeAdapter[AnyMessage] = TypeAdapter(AnyMessage)


def live_router(runner: LivePartner) -> APIRouter:
    """Return the router with the WebSocket."""
    router = APIRouter()

    @router.websocket("/api/v1/live")
    async def live(
        socket: WebSocket,
        rate: Annotated[str, Query(max_length=30)] = "30",
        events: Annotated[str | None, Query(max_length=30)] = None,
    ) -> None:
        await socket.accept()
        try:
            known_queries(socket)
            chosen = _RATE.validate_strings(rate)
            after = None if events in (None, "new") else Cursor.of(events)
        except (ValidationError, InputError) as error:
            allowed = f"rate must be {SLOWEST} to {FASTEST} states a second, got {rate!r}."
            refused = str(error) if isinstance(error, InputError) else allowed
            await socket.send_json({"refused": refused})
            reason = refused.encode("ascii", "replace").decode()
            await socket.close(_POLICY, reason[:_REASON])
            return
        follows = [] if events is None else [follow(runner, after)]
        await _Viewer(runner, socket, chosen, follows).serve()

    return router


class _Viewer:
    """One open WebSocket."""

    def __init__(
        self,
        runner: LivePartner,
        socket: WebSocket,
        rate: float,
        followed: list[AsyncIterator[LiveEvent | None]],
    ) -> None:
        self._runner = runner
        self._socket = socket
        self._period, self._followed = 1 / rate, followed
        self._sending = asyncio.Lock()
        self._mistakes = 0
        self._commands: asyncio.Queue[tuple[str | None, float]] = asyncio.Queue(_WAITING)
        self._left_out = False
        self._overtaken = 0  # commands that a Stop has cancelled, and nobody was told of yet

    async def serve(self) -> None:
        """Send and receive until either side closes."""
        works = [self._send_states(), self._listen(), self._obey_all()]
        works += map(self._send_events, self._followed)
        tasks = [asyncio.create_task(work) for work in works]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
        code = _POLICY if self._mistakes > MISTAKES else _BYE
        # The viewer may have gone already.
        with suppress(RuntimeError, TimeoutError, OSError, WebSocketDisconnect):
            await asyncio.wait_for(self._socket.close(code), 1.0)

    async def _send_states(self) -> None:
        serial = self._runner.snapshot.serial - 1  # earlier ones are old
        due = time.monotonic()
        while self._runner.reachable:
            steps = self._runner.steps_after(serial)
            for step in steps if self._period <= STEP else steps[-1:]:
                serial = step.serial
                await self._send(step.json)
            due = max(due + self._period, time.monotonic())
            await asyncio.sleep(due - time.monotonic())  # until this viewer's next state is due

    async def _send_events(self, events: AsyncIterator[LiveEvent | None]) -> None:
        async for event in events:
            if event is not None:
                told = event.model_dump_json(exclude_none=True)
                await self._send(f'{{"event":{told}}}')

    async def _send(self, text: str) -> None:
        async with asyncio.timeout(PATIENCE), self._sending:
            await self._socket.send_text(text)

    async def _listen(self) -> None:
        """Receive messages: obey a Stop at once, queue the others."""
        while True:
            message = await self._socket.receive()
            if message["type"] == "websocket.disconnect":
                return
            text = message.get("text")
            if (stop := _stop_in(text)) is not None:
                self._runner.stop(press(stop.by, stop.press))
                # A release among the waiting commands would undo this Stop.
                while not self._commands.empty():
                    waiting, _ = self._commands.get_nowait()
                    self._overtaken += _stop_in(waiting) is None
            try:
                self._commands.put_nowait((text, self._runner.read_until))
            except asyncio.QueueFull:
                self._left_out = True

    async def _obey_all(self) -> None:
        while self._mistakes <= MISTAKES:
            text, came = await self._commands.get()
            try:
                if self._overtaken:
                    count, self._overtaken = self._overtaken, 0
                    await self._refuse(f"Stop cancelled waiting commands: {count}.")
                if self._left_out:
                    self._left_out = False
                    raise BusyError("too many commands at once; some were dropped.")
                await self._obey(text, came)
            except (ValidationError, MiburiError, ValueError) as error:
                self._mistakes += not isinstance(error, MiburiError)
                await self._refuse(_words(error))

    async def _refuse(self, words: str) -> None:
        await self._send(TypeAdapter(dict).dump_json({"refused": words}).decode())

    async def _obey(self, text: str | None, came: float) -> None:
        # Each command waits for a step of the loop, so a flood of commands delays only its sender.
        stop = _stop_in(text)
        if stop is None and (text is None or len(text) > LARGEST):
            raise ValueError(f"a message must be text of at most {LARGEST} characters.")
        match stop or _MESSAGE.validate_json(text or ""):
            case HandMessage() as wish:
                await granted(self._runner, move_hand(wish))
            case StimulusMessage() as wish:
                stimulus = Stimulus(wish.feeling, wish.strength, wish.source)
                await granted(self._runner, Feel(stimulus, "program"))
            case StopMessage() as stop if who(stop.by) != stop.by:
                known = ", ".join(each for each in get_args(By) if who(each) == each)
                raise InputError(
                    "The body has stopped, as if a person had pressed Stop: by must be one of "
                    f"{known}, got {stop.by[:30]!r}."
                )
            case StopMessage():
                pass  # it was obeyed when it came
            case ReleaseMessage():
                await granted(self._runner, Release(came=came))
            case RateMessage() as wish:
                self._period = 1 / wish.rate


def _stop_in(text: str | None) -> StopMessage | None:
    """Return a message if it is a Stop, whatever else is in it, else None."""
    with suppress(ValueError, RecursionError):
        message = json.loads(text or "")
        if isinstance(message, dict) and message.get("do") == "stop":
            by, press_id = (message.get(key) for key in ("by", "press"))
            return StopMessage.model_construct(
                do="stop",
                by=by if isinstance(by, str) else "person",
                press=press_id if isinstance(press_id, str) else "",
            )
    return None


def _words(error: Exception) -> str:
    if isinstance(error, ValidationError):
        item = error.errors(include_url=False, include_input=False)[0]
        return f"{'.'.join(str(part) for part in item['loc']) or 'message'}: {item['msg']}"[:300]
    return str(error)[:300]
