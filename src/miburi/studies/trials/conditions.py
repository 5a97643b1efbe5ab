"""Draw the conditions of one trial: the robot's moves, how it differs, and the person.

All ranges are our assumptions; they cover obstacles from a person's fingers to a wall.
"""

from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise

import numpy as np

from miburi import ik
from miburi.feelings import FEELINGS
from miburi.gestures import Repertoire, key_poses, shipped_repertoire
from miburi.robot import Array, Robot
from miburi.robot.mjcf import HAND_MASS
from miburi.safety.move import Move, plan_move
from miburi.studies.trials.plant import Skin, Variation


class HandKind(StrEnum):
    """The behaviour of a person's hand."""

    RIGID = "rigid"  #: stays where it is, like a hand resting on a table
    COMPLIANT = "compliant"  #: gives way
    TOWARDS = "towards"  #: moves towards the robot, and halts when it feels the robot
    GRASPING = "grasping"  #: takes hold of the moving link


#: The links of the robot that a person can meet.
LINKS = (
    "right_upper_arm", "right_forearm", "right_hand",
    "left_upper_arm", "left_forearm", "left_hand", "head",
)  # fmt: skip


@dataclass(frozen=True)
class Person:
    """A person in the way of a link, and where and how the person and the link are to meet."""

    kind: HandKind
    skin: Skin
    link: str
    spot: float  #: on the link, 0 (its joint, or the head's lower edge) to 1
    part: float  #: the share of the link's path that lies before the meeting, 0 to 1
    speed: float  #: m/s, of a hand that moves towards the robot
    tilt: float  #: rad, between the hand's direction and the link's motion
    roll: float  #: rad, around that motion
    reach: float  #: m, how far the fingers reach over the link beyond the meeting point


@dataclass(frozen=True)
class Conditions:
    """What the robot does in one trial, and how it differs from its description.

    ``gesture`` is the gesture's name, and ``pose`` the number of the key pose that the (first) move
    leads to. The robot first rests in ``start``, shape (8,), in rad. Each move comes with the time,
    in s, that the robot rests after it.
    """

    feeling: str
    gesture: str
    mood: float
    pose: int
    start: Array
    moves: tuple[tuple[Move, float], ...]
    variation: Variation


def draw(
    robot: Robot, rng: np.random.Generator, moves: int, repertoire: Repertoire | None = None
) -> Conditions:
    """Draw ``moves`` successive moves of any gesture, by default one that ships with Miburi."""
    # Sorted, so that the order of the feelings does not matter.
    feeling = str(rng.choice(sorted(FEELINGS)))
    mood = float(rng.uniform(0.1, 1.0))
    function = (repertoire or shipped_repertoire()).choose(feeling, rng)
    performance = key_poses(robot, function, mood, variation=int(rng.integers(1 << 30)))
    count = min(moves, len(performance))
    pose = int(rng.integers(len(performance) - count + 1))
    angles = [np.array(robot.neutral)]
    for key_pose in performance[max(pose - 1, 0) : pose + count]:
        angles.append(ik.solve(robot, key_pose.target, start=angles[-1]).angles)
    angles = angles[-count - 1 :]
    planned = tuple(
        (plan_move(robot, before, after, key_pose.duration), min(key_pose.hold, 0.2))
        for (before, after), key_pose in zip(
            pairwise(angles), performance[pose : pose + count], strict=True
        )
    )
    variation = Variation(
        voltage=float(rng.uniform(4.75, 5.25)),
        friction=float(rng.uniform(0.75, 1.25)),
        load=float(rng.choice([0.0, rng.uniform(0.0, 0.01)])),
        noise=float(rng.uniform(0.0, 0.3)),
        delay=int(rng.integers(0, 3)),
    )
    return Conditions(feeling, function.name, mood, pose, angles[0], planned, variation)


def draw_person(rng: np.random.Generator, kind: HandKind) -> Person:
    """Draw somebody who may be in the way of a random link."""
    soft = float(np.exp(rng.uniform(np.log(500.0), np.log(5000.0))))
    stiffness = 75_000.0 if kind is HandKind.RIGID else soft
    damping_ratio = float(rng.uniform(0.3, 1.0))
    skin = Skin(
        stiffness=stiffness,
        damping=2 * damping_ratio * float(np.sqrt(stiffness * HAND_MASS)),
        softness=float(
            rng.uniform(0.004, 0.008) if kind is HandKind.RIGID else rng.uniform(0.008, 0.02)
        ),
        grip=float(rng.uniform(0.3, 1.0)),
    )
    return Person(
        kind=kind,
        skin=skin,
        link=str(rng.choice(LINKS)),
        spot=float(rng.uniform(0.3, 1.0)),
        part=float(rng.uniform(0.1, 0.9)),
        speed=float(rng.uniform(0.1, 0.5)),
        tilt=float(rng.uniform(0.0, np.pi / 6)),
        roll=float(rng.uniform(0.0, 2 * np.pi)),
        reach=float(rng.uniform(0.015, 0.04)),
    )
