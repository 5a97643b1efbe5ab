"""Where each servo sits, and how long the links must be for the parts to fit.

A servo's frame, (3, 4) with the origin in mm, transforms a solid from the servo's own frame to the
frame of the link that holds the servo's case. Links are those of :func:`miburi.robot.shape.links`.
"""

from dataclasses import dataclass
from math import cos, pi, sin
from operator import attrgetter

import numpy as np

from miburi.calibration.file import Mounting
from miburi.hardware.dimensions import dimensions
from miburi.robot import Robot
from miburi.robot.description import JOINTS, Array
from miburi.robot.shape import BASE, links

#: How far the head's servo leans back, in rad, so that the phone's lower edge clears it when the
#: head is bowed.
HEAD_LEAN = 0.65
#: Gap between a yoke's plate and the torso's side, mm.
SIDE_GAP = 0.5
#: The distance, in mm, from the robot's middle to the back of each shoulder's servo: room for plugs
#: and wires.
_BACK_TO_BACK = 4.5


@dataclass(frozen=True)
class Mount:
    """A servo on the robot.

    Attributes
    ----------
    joint
        The joint that it turns.
    link
        The link that carries its case.
    frame
        The servo's own frame on that link, (3, 4), in mm.
    idler
        Whether a fork also holds the servo from behind.
    centred
        The joint's angle, in rad, at which the servo reads 2048. For shoulders that is the middle
        of their range, so that readings do not wrap from 4095 to 0 within it.
    """

    joint: str
    link: str
    frame: Array
    idler: bool
    centred: float = 0.0


def _frame(axle: tuple[float, ...], long: tuple[float, ...], origin: tuple[float, ...]) -> Array:
    """Return the frame of a servo: its horn along ``axle``, its long side along ``long``."""
    y, z = np.array(axle), np.array(long)
    return np.column_stack([np.cross(y, z), y, z, np.array(origin)])


def shoulder_face() -> float:
    """Return the distance of a shoulder's horn from the robot's middle, mm."""
    s = dimensions().servo
    return _BACK_TO_BACK + s.horn_face - s.back


def neck_floor(robot: Robot) -> float:
    """Return the height of the torso's roof, on which the neck stands, mm."""
    return 1000 * robot.lengths.L01 - dimensions().servo.short_end + 9.0


def mounts(robot: Robot) -> list[Mount]:
    """Return the eight servos in the order of the joints."""
    size, face = robot.lengths, dimensions().servo.horn_face
    middle = (dimensions().servo.horn_face + dimensions().servo.idler_face) / 2
    high, head = 1000 * size.L01, 1000 * (size.L01 + size.LH1)
    table = [Mount("waist", BASE, _frame((0, 0, 1), (-1, 0, 0), (0, 0, -face)), False)]
    for side, sign in (("right", -1.0), ("left", 1.0)):
        shoulder = (0.0, sign * (shoulder_face() - face), high)
        elbow = (0.0, sign * 1000 * size.L23, 0.0)
        table += [
            Mount(
                f"{side}_shoulder", "torso", _frame((0, sign, 0), (0, 0, -1), shoulder), False,
                pi / 2,
            ),
            Mount(
                f"{side}_elbow", f"{side}_shoulder", _frame((1, 0, 0), (0, 0, 1), (-middle, 0, 0)),
                True,
            ),
            Mount(
                f"{side}_fingertip", f"{side}_upper_arm",
                _frame((1, 0, 0), (0, -sign, 0), (-middle, *elbow[1:])), True,
            ),
        ]  # fmt: skip
    down = (-sin(HEAD_LEAN), 0.0, -cos(HEAD_LEAN))
    # At this angle the horn's holes lie along the fork, and the notch is at right angles to it.
    centred = robot.shape.phone_level - HEAD_LEAN
    frame = _frame((0, 1, 0), down, (0, -middle, head))
    return [*table, Mount("head", "torso", frame, True, centred)]


def mounting(robot: Robot) -> Mounting:
    """Return ids, directions and zeros of servos that are installed as the parts dictate.

    A servo's readings increase as its horn turns counter-clockwise, as seen from the front. It
    reads 2048 where the horn's single notch points to the short end. Both facts come from
    ROBOTIS's manual and models; for Miburi, nobody has checked them on a servo yet.
    """
    axes = {link.joint: np.array(link.axis) for link in links(robot)}
    table = mounts(robot)
    directions = [1 if axes[mount.joint] @ mount.frame[:, 1] > 0 else -1 for mount in table]
    steps = robot.servo.model.encoder.steps_per_turn
    zeros = [
        steps // 2 - direction * round(mount.centred / robot.servo.step)
        for mount, direction in zip(table, directions, strict=True)
    ]
    return Mounting.model_validate(
        {"id": list(range(1, len(table) + 1)), "direction": directions, "zero": zeros}
    )


def mount_of(robot: Robot, joint: str) -> Mount:
    """Return the servo that turns a joint."""
    return next(mount for mount in mounts(robot) if mount.joint == joint)


def range_of(robot: Robot, joint: str) -> tuple[float, float]:
    """Return a joint's limits, rad."""
    index = JOINTS.index(joint)
    return float(robot.lower[index]), float(robot.upper[index])


def misfits(robot: Robot) -> list[str]:
    """Return one line of text for another servo, and for each length too short for the parts."""
    servo = robot.servo.model.name
    other = f"parts exist for the XL330 only, and this robot has {servo}."
    return ([] if servo.casefold().startswith("xl330") else [other]) + [
        f"{key} is {has:.1f} mm and must be {least:.1f} mm or more "
        f"(short by {least - has:.1f} mm): {why}."
        for key, (least, why) in _least_lengths(robot).items()
        if (has := 1000 * attrgetter(key)(robot)) < least - 1e-9
    ]


def _least_lengths(robot: Robot) -> dict[str, tuple[float, str]]:
    """Return the least value, in mm, of each length that the parts depend on, and why."""
    s, w = dimensions().servo, dimensions().wall
    size, shape = robot.lengths, robot.shape
    mm = 1000
    board = np.hypot(dimensions().mega.length, dimensions().mega.width) / 2
    stack = w.shell + dimensions().mega.post + 1.6 + dimensions().mega.height
    cradle = 3.0 + 1.0 + mm * shape.phone_thickness / 2
    return {
        "lengths.L12": (
            shoulder_face() + w.plate + 8.5 + w.shell + s.half_width,
            "the shoulder's horn, a plate with its screws, and the elbow's servo lie side by side",
        ),
        "lengths.L23": (
            w.web + 4.0 + w.shell + s.long_end,
            "the fingertip's servo reaches back to the bridge of the upper arm",
        ),
        "lengths.L34": (
            w.web + 8.0 + mm * shape.hand_radius,
            "the hand begins behind the bridge of the forearm",
        ),
        "lengths.L01": (
            16.0 + s.long_end + 40.0,
            "the cables' hub stands between the waist and the shoulders' servos",
        ),
        "lengths.LH1": (
            neck_floor(robot) - mm * size.L01 + 14.0 + s.long_end * cos(HEAD_LEAN) + w.shell + 3.0,
            "the head's servo stands above those of the shoulders",
        ),
        "lengths.LH2": (
            (w.knuckle + 1.0 + cradle) / cos(shape.phone_level),
            "the phone's cradle passes in front of the head's servo",
        ),
        "shape.pedestal_radius": (board + 2.0 + w.shell, "the Arduino Mega lies in the foot"),
        "shape.pedestal_height": (
            stack + 3.0 + max(
                s.horn_face - s.back + s.plug_room,
                mm * (size.L23 + size.L34 + shape.hand_radius - size.L01) + 4.0,
            ),
            "the Arduino Mega lies in the foot; the waist's servo and the hands must clear it",
        ),
        "shape.torso_radius": (
            float(np.hypot(s.half_width + 4.0, shoulder_face() - SIDE_GAP)),
            "the shoulders' servos lie in the torso",
        ),
    }  # fmt: skip
