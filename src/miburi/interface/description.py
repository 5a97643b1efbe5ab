"""A robot's description for programs: what a viewer needs to draw it."""

import numpy as np

from miburi.feelings import FEELINGS, SOURCES
from miburi.live.view import LivePartner
from miburi.robot import JOINTS
from miburi.robot.mjcf import HAND_AWAY, HAND_SIZE
from miburi.robot.shape import COLOURS, links, parts
from miburi.wire.robot import LinkOut, PartOut, RobotOut

__all__ = ["describe"]


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
        links=[
            LinkOut(
                name=link.name,
                parent=link.parent,
                joint=link.joint,
                position=list(link.position),
                axis=list(link.axis),
            )
            for link in links(robot)
        ],
        parts=[
            PartOut(
                link=part.link,
                name=part.name,
                kind=part.kind,
                size=list(part.size),
                position=list(part.position),
                end=None if part.end is None else list(part.end),
                tilt=part.tilt,
                colour=list(COLOURS[part.colour]),
            )
            for part in parts(robot)
        ],
    )
