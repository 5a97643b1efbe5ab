"""The whole web application: the interface, the live WebSocket, and the pages."""

from pathlib import Path

from fastapi import APIRouter, FastAPI, Request
from fastapi.responses import JSONResponse
from fastapi.staticfiles import StaticFiles
from starlette.routing import Match

from miburi.doors.doors import Doors
from miburi.interface.api import make_api
from miburi.interface.socket import live_router
from miburi.live.view import LivePartner
from miburi.serving.beside import beside
from miburi.serving.health import health_router
from miburi.serving.reach import Reach
from miburi.studio.body_shapes import shapes_router
from miburi.studio.face_page import add_face_page
from miburi.studio.on_demand import OnDemand
from miburi.studio.pages import people_page
from miburi.studio.pairing import pairing_router
from miburi.studio.privacy_page import privacy_router
from miburi.talk.synthesizer import LANGUAGES

_CLOSED = Doors()


def make_app(
    runner: LivePartner, reach: Reach, doors: Doors = _CLOSED, folder: Path | None = None
) -> FastAPI:
    """Return the application for a live partner; NiceGUI allows one studio in a process.

    ``folder`` keeps what the partner knows about people; without a folder, the partner forgets
    people when it ends.
    """
    app = make_api(runner, doors.talk, doors.care, doors.seed, folder)
    app.include_router(live_router(runner))
    app.include_router(pairing_router(reach))
    app.include_router(health_router(lambda: runner.snapshot.serial))
    app.mount("/static", StaticFiles(directory=Path(__file__).parent / "static"), name="static")
    doors.open(app, runner, next(iter(reach.addresses), None))
    sounded = () if doors.voice is None else LANGUAGES
    add_face_page(app, runner, sounded, doors.care)
    app.include_router(shapes_router(runner))
    app.include_router(_nothing(app))
    app.include_router(privacy_router(runner, reach, doors))
    app.get("/people", include_in_schema=False)(people_page)
    studio = OnDemand(runner, reach, sounded, doors.care)
    beside(app, studio.while_served)
    app.mount("/", studio)
    return app


def _nothing(app: FastAPI) -> APIRouter:
    """Return routes that answer unknown addresses under ``/api`` in JSON."""
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
