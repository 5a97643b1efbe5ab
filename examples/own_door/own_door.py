"""Add a door: `GET /lamp` returns a colour, for a lamp that asks every second.

pip install ./examples/own_door
miburi run --door lamp
"""

from fastapi import FastAPI, Response

from miburi.live.view import LivePartner

COLOURS = {"stopped": "red", "returning": "yellow"}


def open_door(app: FastAPI, partner: LivePartner) -> None:
    """Add the door to the partner's server; pyproject.toml names this function."""

    @app.get("/lamp")
    def lamp() -> Response:
        phase = partner.snapshot.state.phase
        return Response(COLOURS.get(phase, "green"), media_type="text/plain")
