"""The arm's printed parts: yoke, upper arm, and forearm with its hand.

Each part is made for a left arm, in mm in the frame of its link: the origin is the link's joint, x
points forward, y outwards, z up. The caller mirrors the part for the right arm. ``side`` says which
arm's ranges the stops enforce; ``fit`` is the gap on each side of a pocket, in mm.
"""

import numpy as np

from miburi.hardware import servo
from miburi.hardware.dimensions import dimensions
from miburi.hardware.places import mount_of, range_of, shoulder_face
from miburi.hardware.solids import Manifold, ball, box, cut, disc, hull, join, moved, rod
from miburi.robot import Robot
from miburi.robot.description import Array

#: How far the arm extends above and below its axis, in mm: half its thickness.
_HALF = 9.0
_OUTWARDS = np.array([0.0, 1.0, 0.0])
_FORWARD = np.array([1.0, 0.0, 0.0])


def yoke(robot: Robot, side: str, fit: float) -> Manifold:
    """Return the part on the shoulder's horn: a plate, and a holder for the elbow's servo."""
    s, w = dimensions().servo, dimensions().wall
    frame = mount_of(robot, "left_elbow").frame
    face = shoulder_face() - 1000 * robot.lengths.L12  # y of the shoulder's horn
    wall = -s.half_width - fit - w.shell
    plate = disc("y", (0, 0), (face, face + w.plate), 12.0)
    tab = servo.shoulder_tab(*range_of(robot, f"{side}_shoulder"), w.plate).translate((0, face, 0))
    root = disc("y", (0, 0), (face + w.plate - 0.1, face + w.plate), 12.0)
    collar = hull(root, box((-11.4, 11.4), (wall, wall + w.shell), (-11.0, s.long_end)))
    bay = servo.driver_room(face, 1, wall + w.shell - face - w.plate)
    low, high = _range(robot, side, "elbow")
    bridge = box((-20, 20), (w.web - 1.0, w.web + 12.0), (-_HALF - 2, _HALF + 2))
    sweep = [
        bridge.rotate((float(np.degrees(turn)), 0, 0))
        for turn in np.linspace(low - 0.12, high + 0.12, 24)
    ]
    # A screwdriver reaches the horn's screws through the empty holder.
    ways = [rod((x, 0.0, z), (x, 20.0, z), 2.2) for x, z in servo.circle()]
    # The upper access hole opens into the plug's window, as a wall between them would be too thin.
    ways.append(hull(ways[1], ways[1].translate((-4.0, 0, 0))))
    body = cut(
        join([plate, collar, tab]),
        [bay, moved(servo.pocket(fit), frame), *servo.horn_screws(face, 1)],
    )
    return cut(join([_holder(robot, side, "elbow", fit), body]), [*sweep, *ways, bay])


def upper_arm(robot: Robot, side: str, fit: float) -> Manifold:
    """Return the upper arm: a fork, a bridge, and the fingertip's servo in its holder."""
    s, w = dimensions().servo, dimensions().wall
    begin = 1000 * robot.lengths.L23 - s.long_end - fit - w.shell
    wide = servo.fork_half_width()
    bridge = hull(
        box((-wide, wide), (w.web, w.web + w.shell), (-_HALF, _HALF)),
        box((-11.0, 11.0), (begin, begin + w.shell), (-_HALF, _HALF)),
    )
    frame = mount_of(robot, "left_fingertip").frame
    whole = join([_fork(w.web + w.shell - 0.4), bridge, _holder(robot, side, "fingertip", fit)])
    return cut(whole, [moved(servo.pocket(fit), frame)])


def forearm(robot: Robot) -> Manifold:
    """Return the forearm: a fork on the fingertip's servo that ends in a round hand."""
    w, wide = dimensions().wall, servo.fork_half_width()
    length, radius = 1000 * robot.lengths.L34, 1000 * robot.shape.hand_radius
    arm = hull(
        box((-wide, wide), (w.web, w.web + w.shell), (-_HALF, _HALF)),
        disc("x", (length - radius, 0), (-8.0, 8.0), 7.0),
    )
    hand = ball((0, length, 0), radius)
    wrist = rod((0, w.web + 6, 0), (0, length, 0), 8.0)
    knuckle = disc("x", (0, 0), (w.plate - wide, wide - w.plate), w.web)
    return cut(join([_fork(w.web + w.shell - 0.4), arm, wrist, hand]), [knuckle])


def _range(robot: Robot, side: str, joint: str) -> tuple[float, float]:
    """Return the limits of an elbow or fingertip, in rad, as a left arm would have them."""
    low, high = range_of(robot, f"{side}_{joint}")
    return (low, high) if side == "left" else (-high, -low)


def _holder(robot: Robot, side: str, joint: str, fit: float) -> Manifold:
    """Return a joint's servo holder with its stops, on the link that carries it."""
    frame = mount_of(robot, f"left_{joint}").frame
    span = servo.cheek_span(frame, _FORWARD, _OUTWARDS, _range(robot, side, joint))
    return moved(join([servo.holder(fit), servo.stops(*span, fit)]), frame)


def _fork(reach: float) -> Manifold:
    """Return the fork's two side plates, which cross the x axis at both ends and point outwards."""
    s = dimensions().servo
    middle = (s.horn_face + s.idler_face) / 2
    frame: Array = np.array([[0.0, 1.0, 0.0, -middle], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0]])
    return moved(servo.cheeks(reach), frame)
