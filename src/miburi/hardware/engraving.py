"""Engrave parts with their servo's symbol and number, so that they are not mixed up.

The symbols are those in the robot's file (W, RS, ... H); the numbers are the ids that ``miburi card
calibrate --ids`` assigns. If a fork or plate covers the servo's horn, a slot shows the horn's
single notch when the servo reads 2048 (of 4096 steps).
"""

import numpy as np

from miburi.hardware import head
from miburi.hardware.dimensions import dimensions
from miburi.hardware.places import SIDE_GAP, mount_of, neck_floor, shoulder_face
from miburi.hardware.solids import Manifold, Numbers, hull, letters, moved, rod
from miburi.hardware.trunk import foot_floor, lid_height
from miburi.robot import Robot
from miburi.robot.description import JOINTS
from miburi.robot.shape import links

#: How deep letters are cut in, in mm.
_DEPTH = 0.6
#: Height of the letters, and the radius at which the slot over a horn's notch begins, both in mm.
_HIGH, _NOTCH = 3.6, 7.6


def _name(robot: Robot, joint: str) -> str:
    return f"{getattr(robot.joints, joint).symbol} {JOINTS.index(joint) + 1}"


def _on(text: str, place: Numbers, out: Numbers, along: Numbers, high: float = _HIGH) -> Manifold:
    """Return letters sunk into a face; ``out`` is its normal, ``along`` the text's direction."""
    z, x = np.array(out, dtype=float), np.array(along, dtype=float)
    frame = np.column_stack([x, np.cross(z, x), z, np.array(place) - _DEPTH * z])
    return moved(letters(text, high, _DEPTH + 2.0), frame)


def texts(robot: Robot, fit: float) -> dict[str, list[Manifold]]:
    """Return the letters that are cut out of each part, in mm in the frame of the part's link."""
    s, w = dimensions().servo, dimensions().wall
    size, c = robot.lengths, head.clamp(robot)
    up, left, ahead = (0, 0, 1), (0, 1, 0), (1, 0, 0)
    side = shoulder_face() - SIDE_GAP
    high = 1000 * size.L01
    table: dict[str, list[Manifold]] = {
        "foot": [_on("5 V ONLY", (-20.0, 0.0, foot_floor(robot)), up, left, 5.0)],
        "lid": [_on("FRONT", (53.0, 0.0, lid_height(robot)), up, left, 5.0)],
        "column": [
            _on(_name(robot, "waist"), (0.0, -21.0, 0.0), up, ahead, 5.0),
            _on("FRONT", (28.2, 0.0, 0.0), up, left, 3.2),
        ],
        "torso": [
            _on("FRONT", (21.0, 0.0, neck_floor(robot)), up, left, 4.5),
            _on(_name(robot, "left_shoulder"), (0, side, high - 27.5), left, (-1, 0, 0)),
            _on(_name(robot, "right_shoulder"), (0, -side, high - 27.5), (0, -1, 0), ahead),
        ],
        "neck": [
            _on(
                _name(robot, "head"), (-24.0, 0.0, neck_floor(robot) + 6.0), (-1, 0, 0), (0, -1, 0)
            )
        ],
        # The name is on the back of the cradle's plate, between and above the fork's cheeks.
        "cradle": [
            _on("HEAD", c.frame[:, :3] @ [c.plate, 18.0, 20.0], -c.frame[:, 0], (0, -1, 0))
        ],
    }  # fmt: skip
    wide = s.half_width + fit + w.shell
    top = s.long_end + fit + w.shell
    for name, sign in (("left", 1.0), ("right", -1.0)):
        mid = sign * (1000 * size.L23 - 12.0)
        reading = (-sign, 0.0, 0.0)
        table |= {
            f"{name}_yoke": [
                _on(_name(robot, f"{name}_elbow"), (0, 0, top), up, (0, -1, 0), 4.5),
            ],
            f"{name}_upper_arm": [
                _on(_name(robot, f"{name}_fingertip"), (-5.0, mid, wide), up, reading),
            ],
            f"{name}_forearm": [
                _on(name[0].upper(), (0, sign * 30.0, 8.75), up, reading, 6.0),
            ],
        }
    return table


def notch_slots(robot: Robot) -> dict[str, Manifold]:
    """Return the slot to cut out of each part on a horn, in mm in the frame of the part's link."""
    rim = 13.0  # a cheek's slot runs out through its edge, so that no thin sliver is left
    table = {
        "torso": _notch_slot(robot, "waist", (0, 0, 0), 9.8),
        "cradle": _notch_slot(robot, "head", (0, 0, 0), rim),
    }
    for name, sign in (("left", 1.0), ("right", -1.0)):
        face = sign * (shoulder_face() - 1000 * robot.lengths.L12)
        table |= {
            f"{name}_yoke": _notch_slot(robot, f"{name}_shoulder", (0, face, 0), 9.0),
            f"{name}_upper_arm": _notch_slot(robot, f"{name}_elbow", (0, 0, 0), rim),
            f"{name}_forearm": _notch_slot(robot, f"{name}_fingertip", (0, 0, 0), 10.6),
        }
    return table


def _notch_slot(robot: Robot, joint: str, origin: Numbers, outside: float) -> Manifold:
    """Return the slot through which the horn's notch is seen when the servo reports 2048.

    The notch then points to the servo's short end. At a joint angle of 0, the axes of a link
    are parallel to those of its parent. ``origin`` is the joint's position on the link that the
    joint turns. ``outside`` is the radius at which the slot ends, in mm.
    """
    mount = mount_of(robot, joint)
    axle, notch = mount.frame[:, 1], -mount.frame[:, 2]
    axis = next(np.array(link.axis) for link in links(robot) if link.joint == joint)
    # In the link's frame, the parent's directions are turned by minus the joint's angle.
    turn, aside = -mount.centred, np.cross(axis, notch)
    way = np.cos(turn) * notch + np.sin(turn) * aside
    ends = []
    for radius in (_NOTCH, outside):
        begin = np.array(origin, dtype=float) + radius * way
        near = begin if not mount.idler else begin + 10.0 * axle
        ends.append(rod(near - axle, near + 12.0 * axle, 0.8))
    return hull(*ends)
