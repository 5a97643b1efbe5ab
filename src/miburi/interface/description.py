"""Describe a robot to programs, so that they can draw it, and describe the interface."""

from dataclasses import asdict
from http import HTTPStatus
from typing import Any

import numpy as np
from fastapi import FastAPI

from miburi.feelings import FEELINGS, SOURCES
from miburi.live.view import LivePartner
from miburi.robot import JOINTS
from miburi.robot.mjcf import HAND_AWAY, HAND_SIZE
from miburi.robot.shape import COLOURS, links, parts
from miburi.version import __version__
from miburi.wire.messages import Refusal
from miburi.wire.robot import LinkOut, PartOut, RobotOut

#: The answers that the gate before every request may give.
_GATE = {
    "401": "A token is needed here, or this one is wrong or was withdrawn.",
    "403": "The request comes from a page of another site, or by a name that is not this server's.",
    "426": "No token is accepted over plain http.",
}
_LONG = "The request is too long."


def describe(runner: LivePartner) -> RobotOut:
    """Return the robot's description, from which a viewer builds the scene."""
    robot = runner.robot
    return RobotOut(
        name=robot.name,
        joints=list(JOINTS),
        feelings=list(FEELINGS),
        sources=list(SOURCES),
        temperaments=runner.temperaments,
        neutral=np.asarray(robot.neutral).tolist(),
        lower=np.asarray(robot.lower).tolist(),
        upper=np.asarray(robot.upper).tolist(),
        floor=-robot.shape.pedestal_height,
        threshold=runner.motors.rule.ratio,
        hand=list(HAND_SIZE),
        hand_away=list(HAND_AWAY),
        links=[LinkOut.model_validate(link, from_attributes=True) for link in links(robot)],
        parts=[
            PartOut.model_validate(asdict(part) | {"colour": COLOURS[part.colour]})
            for part in parts(robot)
        ],
        version=__version__,
        since=runner.since,
    )


def describe_interface(app: FastAPI) -> None:
    """Add the token and the schema of refusals to the description.

    A model for each refusal of each route would double the time that FastAPI takes.
    """
    described = app.openapi
    refusal = {"application/json": {"schema": {"$ref": "#/components/schemas/Refusal"}}}

    def whole() -> dict[str, Any]:
        schema = described()
        key = {"type": "http", "scheme": "bearer", "description": "Needed from other computers."}
        schema["components"]["securitySchemes"] = {"token": key}
        schema["security"] = [{}, {"token": []}]
        schema["components"]["schemas"]["Refusal"] = Refusal.model_json_schema()
        for operations in schema["paths"].values():
            for operation in operations.values():
                for status, words in _GATE.items():
                    operation["responses"].setdefault(status, {"description": words})
                if "requestBody" in operation:
                    operation["responses"].setdefault("413", {"description": _LONG})
                for status, answer in operation["responses"].items():
                    if int(status) >= HTTPStatus.BAD_REQUEST:
                        answer.setdefault("content", refusal)
        return schema

    app.openapi = whole  # type: ignore[method-assign]
