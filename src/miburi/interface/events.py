"""Report events: as a list after a cursor, or as a stream of server-sent events.

Both report the same events under the same names, even those from before the partner's last start.
The reader's cursor tells a stream what the reader has missed, so a reader continues after a break;
a ``gap`` stands for events that are no longer kept.
"""

import asyncio
from collections.abc import AsyncIterator, Callable
from typing import Annotated

from fastapi import APIRouter, Header, Query, Request
from fastapi.responses import StreamingResponse

from miburi.errors import InputError
from miburi.live.events.event import Cursor, EventKind, LiveEvent, without_words
from miburi.live.view import LivePartner
from miburi.serving.access import EVENTS

#: The attribute of an application's state that is set when its server shuts down; event streams
#: close themselves when they see it.
ENDING = "ending"
#: The most events in one answer.
MOST = 1_000
#: The interval in s between two checks for new events, the silence in s after which a stream sends
#: a keep-alive, and the time in ms after which a reader reconnects (all our numbers).
_GLANCE, _SILENCE, _RETRY = 0.01, 10.0, 1_000
_PIECE = 100

AfterCursor = Annotated[
    str | None,
    Query(
        description="The id of the latest event that you know, `BOOT:NUMBER`, or its number; "
        "`0`: all that are kept.",
        examples=["5f2c9a10:42"],
    ),
]


def add_events(router: APIRouter, partner: LivePartner) -> None:
    """Add the routes for past events, and for events as they happen."""

    @router.get(
        "/log",
        operation_id="log",
        response_model=list[LiveEvent],
        responses={
            400: {"description": "The cursor is not of the form `BOOT:NUMBER` or `NUMBER`."}
        },
    )
    async def log(after: AfterCursor = None) -> list[LiveEvent]:
        """Return the events after a given event, oldest first; if none is given, the latest events.

        At most 1,000 are returned; ask again with the id of the last one. If earlier events are no
        longer kept, the list begins with a `gap`.
        """
        if after is None:
            return _hide_words(partner, partner.history.after(0))
        return await events_after(partner, Cursor.of(after), MOST)

    @router.get(
        EVENTS.removeprefix("/api/v1"),
        operation_id="events",
        response_class=StreamingResponse,
        responses={
            200: {"content": {"text/event-stream": {"example": _EXAMPLE}}},
            400: {
                "description": "There is no such kind, or the cursor is not of the form "
                "`BOOT:NUMBER` or `NUMBER`."
            },
            503: {"description": "Too many streams are open."},
        },
    )
    async def events(
        request: Request,
        after: AfterCursor = None,
        kinds: Annotated[
            str | None,
            Query(max_length=400, description="Only these, comma-separated.", examples=["stop"]),
        ] = None,
        last_event_id: Annotated[
            str | None,
            Header(description="Sent by a browser when it reconnects."),
        ] = None,
    ) -> StreamingResponse:
        """Send events as they happen (server-sent events), each with its `id` and JSON `data`.

        The stream begins after the event in `Last-Event-ID` or `after`, or else with the next one.
        """
        known = last_event_id or after
        cursor = _now(partner) if known is None else Cursor.of(known)
        wanted = None if kinds is None else _kinds(kinds)
        return StreamingResponse(
            _stream(partner, cursor, wanted, lambda: getattr(request.app.state, ENDING, False)),
            media_type="text/event-stream",
            headers={"Cache-Control": "no-store"},
        )


_EXAMPLE = (
    'id: 5f2c9a10:42\ndata: {"boot":"5f2c9a10","number":42,"wall":"2026-11-24T10:00:00.000+00:00",'
    '"time":12.4,"kind":"stop","id":"5f2c9a10:42"}\n\n'
)


async def events_after(partner: LivePartner, cursor: Cursor, most: int) -> list[LiveEvent]:
    """Return at most ``most`` events after a cursor; a ``gap`` marks where some are missing."""
    history = partner.history
    if history.reaches(cursor):
        return _hide_words(partner, history.since(cursor, most))
    return _hide_words(partner, await asyncio.to_thread(history.since, cursor, most))


async def follow(
    partner: LivePartner,
    after: Cursor | None = None,
    silence: float = _SILENCE,
    over: Callable[[], bool] = lambda: False,
) -> AsyncIterator[LiveEvent | None]:
    """Yield events after a cursor (default: from now on) until ``over()`` is true.

    Yield None after ``silence`` s without an event.
    """
    cursor = after or _now(partner)
    loop = asyncio.get_running_loop()
    spoke, seen = loop.time(), -1
    while not over():
        if partner.history.number == seen:
            if loop.time() - spoke > silence:
                spoke = loop.time()
                yield None
            await asyncio.sleep(_GLANCE)
            continue
        seen = partner.history.number
        while events := await events_after(partner, cursor, _PIECE):
            cursor, spoke = events[-1].cursor, loop.time()
            for event in events:
                yield event


async def _stream(
    partner: LivePartner, after: Cursor, kinds: set[str] | None, over: Callable[[], bool]
) -> AsyncIterator[str]:
    yield f"retry: {_RETRY}\n\n"
    async for event in follow(partner, after, over=over):
        if event is None:
            yield ": nothing new\n\n"
        elif kinds is None or event.kind in kinds:
            yield f"id: {event.id}\ndata: {event.model_dump_json(exclude_none=True)}\n\n"


def _now(partner: LivePartner) -> Cursor:
    return Cursor(partner.history.boot, partner.history.number)


def _hide_words(partner: LivePartner, events: list[LiveEvent]) -> list[LiveEvent]:
    if not partner.snapshot.state.words:
        return [without_words(event) for event in events]
    # Words said before the user last changed the privacy setting are left out of events.
    since = max((e.number for e in partner.history.after(0) if e.kind == "words"), default=0)
    return [event if event.number > since else without_words(event) for event in events]


def _kinds(text: str) -> set[str]:
    known = EventKind.__args__  # type: ignore[attr-defined]
    kinds = {kind.strip() for kind in text.split(",") if kind.strip()}
    if unknown := kinds.difference(known):
        raise InputError(
            f"{', '.join(sorted(unknown))}: there is no such kind of event; the kinds are "
            f"{', '.join(known)}."
        )
    return kinds | {"gap"}
