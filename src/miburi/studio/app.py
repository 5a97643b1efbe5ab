"""The whole application: the interface, the live WebSocket, and the pages."""

from pathlib import Path

from fastapi import FastAPI
from fastapi.staticfiles import StaticFiles
from nicegui import ui

from miburi.interface.api import make_api
from miburi.interface.pairing import pairing_router
from miburi.interface.socket import live_router
from miburi.live.runner import Runner
from miburi.studio.face_page import add_face_page
from miburi.studio.studio_page import add_studio_page

__all__ = ["HERE", "make_app"]

HERE = Path(__file__).parent


def make_app(runner: Runner, addresses: list[str], token: str | None) -> FastAPI:
    """Return the application around a live partner; NiceGUI allows one in a process.

    Parameters
    ----------
    runner
        The partner.
    addresses
        Under which other devices reach this server.
    token
        What they need, to be shown as QR code; None on the loopback address.
    """
    app = make_api(runner)
    app.include_router(live_router(runner))
    app.include_router(pairing_router(token))
    app.mount("/static", StaticFiles(directory=HERE / "static"), name="static")
    add_face_page(app)
    add_studio_page(runner, addresses, token)
    ui.run_with(
        app,
        title="Miburi",
        favicon=HERE / "static" / "icon.svg",
        dark=None,
        binding_refresh_interval=None,
        show_welcome_message=False,
        reconnect_timeout=10.0,
        tailwind=False,
    )
    return app
