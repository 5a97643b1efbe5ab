"""The printed parts and servos that the studio draws, if the robot can be built."""

import asyncio
from base64 import b64encode

from fastapi import APIRouter

from miburi.hardware.shapes import shapes_if_it_can_be_built
from miburi.live.view import LivePartner
from miburi.robot import Robot
from miburi.robot.shape import COLOURS


def shapes_router(runner: LivePartner) -> APIRouter:
    """Return the route of the shapes: a list, which is empty if the robot cannot be built."""
    router = APIRouter(include_in_schema=False)

    @router.get("/api/page/shapes")
    async def shapes() -> list[dict[str, object]]:
        return await asyncio.to_thread(_shapes, runner.robot)

    return router


def _shapes(robot: Robot) -> list[dict[str, object]]:
    solids = shapes_if_it_can_be_built(robot)
    if not solids:
        return []
    # This needs the extra ``hardware``.
    from miburi.hardware.exports import triangles

    table: list[dict[str, object]] = []
    for (link, colour), solid in solids.items():
        corners, faces = triangles(solid)
        points = b64encode((corners / 1000).astype("<f4").tobytes()).decode()
        indices = b64encode(faces.astype("<u4").tobytes()).decode()
        table.append({"link": link, "colour": COLOURS[colour], "points": points, "faces": indices})
    return table
