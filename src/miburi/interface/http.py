"""How the server listens: what it grants a connection before anybody knows who asks."""

import uvicorn
from starlette.types import ASGIApp

from miburi.interface.access import LARGEST

__all__ = ["configure"]


def configure(app: ASGIApp, *, lifespan: bool = True) -> uvicorn.Config:
    """Return how an application is served; every server of ours is configured by this.

    Parameters
    ----------
    app
        What answers, behind its :class:`~miburi.interface.access.Gate`.
    lifespan
        Whether it is told of the server's start and end.
    """
    return uvicorn.Config(
        app,
        log_level="warning",
        lifespan="on" if lifespan else "off",
        ws="websockets-sansio",
        ws_max_size=LARGEST,
        timeout_graceful_shutdown=2,
        server_header=False,
        proxy_headers=False,  # who asks is who has connected, whatever a header says
    )
