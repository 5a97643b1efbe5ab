"""Whether the program works, for containers and monitors; the path needs no token."""

import asyncio
from collections.abc import Callable

from fastapi import APIRouter
from fastapi.responses import JSONResponse

from miburi.serving.access import HEALTH

#: For how long to wait for a step, and the time between two looks, s (our choice).
_PATIENCE, _LOOK = 2.0, 0.05


def health_router(step: Callable[[], int]) -> APIRouter:
    """Return the route that says whether ``step``, the number of the latest step, goes up."""
    router = APIRouter(include_in_schema=False)

    @router.api_route(HEALTH, methods=["GET", "HEAD"])
    async def health() -> JSONResponse:
        before = step()
        for _ in range(round(_PATIENCE / _LOOK)):
            await asyncio.sleep(_LOOK)
            if step() != before:
                return JSONResponse({"alive": True})
        return JSONResponse({"alive": False}, 503)

    return router
