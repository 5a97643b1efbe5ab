"""Put the web application together: the interface, the live WebSocket, and the pages."""

import time
from functools import partial
from pathlib import Path

from fastapi import APIRouter, FastAPI, Request
from fastapi.responses import JSONResponse
from fastapi.staticfiles import StaticFiles
from nicegui import Client, ui
from nicegui import app as pages
from starlette.routing import Match

from miburi.doors.doors import Doors
from miburi.interface.api import make_api
from miburi.interface.socket import live_router
from miburi.live.view import LivePartner
from miburi.serving.reach import Reach
from miburi.studio.body_shapes import shapes_router
from miburi.studio.face_page import add_face_page
from miburi.studio.missing_page import missing_page
from miburi.studio.pairing import pairing_router
from miburi.studio.pairing_page import pairing_page
from miburi.studio.people_page import people_router
from miburi.studio.privacy_page import privacy_router
from miburi.studio.studio_page import add_studio_page
from miburi.talk.synthesizer import LANGUAGES

__all__ = ["HERE", "forget_pages", "make_app"]

HERE = Path(__file__).parent
_CLOSED = Doors()
#: s between checks for pages that no browser has connected to; each takes about 0.8 MB. NiceGUI
#: keeps them for 60 s, because a slow computer needs that long.
_LOOKS = 5.0
#: If more pages than the first number are waiting, those older than the second number, in s, are
#: dropped.
_MANY, _FLOODED = 20, 10.0


def make_app(
    runner: LivePartner, reach: Reach, doors: Doors = _CLOSED, folder: Path | None = None
) -> FastAPI:
    """Return the application for a live partner; NiceGUI allows one in a process.

    Parameters
    ----------
    runner
        The partner.
    reach
        How other devices reach this server, to show as a QR code.
    doors
        The doors (other protocols) that are open besides HTTP.
    folder
        The folder for what the partner knows about people; None: it forgets that when it ends.
    """
    app = make_api(runner, doors.talk, doors.care, doors.seed, folder)
    app.include_router(live_router(runner))
    app.include_router(pairing_router(reach, partial(pairing_page, reach)))
    app.mount("/static", StaticFiles(directory=HERE / "static"), name="static")
    doors.open(app, runner, next(iter(reach.addresses), None))
    sounded = () if doors.voice is None else LANGUAGES
    add_face_page(app, runner, sounded)
    app.include_router(shapes_router(runner))
    app.include_router(_nothing(app))
    app.include_router(privacy_router(runner, reach, doors))
    app.include_router(people_router())
    add_studio_page(runner, reach, sounded)
    # Quasar would show an unlabelled bar at every request of its own.
    pages.config.quasar_config["loadingBar"]["skipHijack"] = True
    # NiceGUI's own page would keep a client for each request, and log the visitor's URL.
    pages.add_exception_handler(404, missing_page)
    pages.timer(_LOOKS, forget_pages)
    ui.run_with(
        app,
        title="Miburi",
        favicon=HERE / "static" / "icon.svg",
        dark=None,
        binding_refresh_interval=None,
        show_welcome_message=False,
        reconnect_timeout=30.0,  # a page that was busy for a while is not reloaded
        tailwind=False,
    )
    return app


def forget_pages() -> None:
    """Drop pages that no browser has connected to, if many were requested within a minute."""
    since = time.time() - 60
    waiting = (each for each in Client.instances.values() if not each.has_socket_connection)
    if sum(each.created > since for each in waiting) > _MANY:
        Client.prune_instances(client_age_threshold=_FLOODED)


def _nothing(app: FastAPI) -> APIRouter:
    """Return routes that answer unknown addresses under ``/api`` with JSON, not NiceGUI's page."""
    router = APIRouter(include_in_schema=False)
    methods = ["GET", "HEAD", "POST", "DELETE"]  # the gate refuses others

    @router.api_route("/api", methods=methods)
    @router.api_route("/api/{path:path}", methods=methods)
    async def nothing(request: Request) -> JSONResponse:
        scope = request.scope
        if any(route.matches(scope)[0] is Match.PARTIAL for route in app.routes):
            return JSONResponse(
                {"detail": f"{scope['method']} is not allowed at this address."}, 405
            )
        return JSONResponse({"detail": "there is nothing at this address."}, 404)

    return router
