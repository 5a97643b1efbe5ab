"""The studio draws printed parts if the robot can be built, and its description's solids if not."""

from base64 import b64decode
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient

from miburi.live.view import LivePartner
from miburi.robot import Robot, buildable, iphonoid
from miburi.robot.shape import BASE, links
from miburi.studio.body_shapes import shapes_router


def ask(robot: Robot) -> list[dict[str, Any]]:
    app = FastAPI()
    app.include_router(shapes_router(cast(LivePartner, SimpleNamespace(robot=robot))))
    answer = TestClient(app).get("/api/page/shapes")
    assert len(answer.content) < 2e6
    return cast(list[dict[str, Any]], answer.json())


def test_a_robot_that_can_be_built_is_drawn_as_printed() -> None:
    robot = buildable()
    shapes = ask(robot)
    assert {shape["link"] for shape in shapes} == {BASE, *(link.name for link in links(robot))}
    points = {
        (shape["link"], tuple(shape["colour"])): np.frombuffer(
            b64decode(shape["points"]), "<f4"
        ).reshape(-1, 3)
        for shape in shapes
    }
    for shape in shapes:
        own = points[shape["link"], tuple(shape["colour"])]
        faces = np.frombuffer(b64decode(shape["faces"]), "<u4")
        assert len(faces) % 3 == 0
        assert faces.max() == len(own) - 1
    # In metres, down to the table and as wide as the foot.
    base = np.concatenate([own for (link, _), own in points.items() if link == BASE])
    assert base[:, 2].min() == pytest.approx(-robot.shape.pedestal_height, abs=1e-4)
    assert np.abs(base[:, 1]).max() == pytest.approx(robot.shape.pedestal_radius, abs=1e-4)


def test_a_robot_that_cannot_be_built_is_drawn_from_its_description() -> None:
    assert ask(iphonoid()) == []
