"""The fleet's page: all partners on one broker, and Stop for one or all."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Annotated

from fastapi import FastAPI, Request
from fastapi.responses import HTMLResponse
from pydantic import Field

from miburi.doors.fleet import Fleet, FleetOut, listening_to
from miburi.doors.topics import ALL
from miburi.interface.refusing import refuse_in_words
from miburi.serving.access import STOP
from miburi.serving.beside import beside
from miburi.studio.pages import page as page_of
from miburi.studio.preferences import Preferences
from miburi.studio.words import words
from miburi.wire.messages import Message


class StopIn(Message):
    """The partner to stop, or all."""

    name: Annotated[str, Field(max_length=81)] = ALL


def make_fleet_app(fleet: Fleet) -> FastAPI:
    """Return the app of a fleet's page, which connects the fleet while it runs."""
    app = FastAPI(openapi_url=None)
    refuse_in_words(app)

    @asynccontextmanager
    async def listening() -> AsyncIterator[None]:
        async with listening_to(fleet):
            yield

    beside(app, listening)

    @app.get("/")
    async def page(request: Request) -> HTMLResponse:
        say = words(Preferences.of(request).language)
        content = {name: say[name] for name in ("fleet", "feeling", "phase", "reason", "joint")}
        return page_of(request, "fleet", words=content)

    @app.get("/api/v1/fleet")
    async def news() -> FleetOut:
        """Return all partners."""
        return fleet.news

    @app.post(STOP, status_code=204)
    async def stop(wish: StopIn) -> None:
        """Stop one partner, or all."""
        await fleet.stop(wish.name)

    return app
