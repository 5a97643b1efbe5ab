"""The boards in foot and torso, and the routes of the cables.

The Mega, the buffer's board in the foot and the hub's in the torso are simple blocks. Solids are in
the frame of the link that carries them, in mm.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from miburi.hardware.dimensions import dimensions
from miburi.hardware.places import mount_of, neck_floor
from miburi.hardware.solids import Manifold, Numbers, ball, box, cut, disc, join, rod
from miburi.hardware.trunk import card_screws, foot_floor, hub_floor, lid_screws
from miburi.robot import Array, Robot
from miburi.robot.shape import BASE

#: A point on a cable's route: the name of the thing with which the cable moves there, the link that
#: carries this thing, and x, y and z in mm.
Point = tuple[str, str, Numbers]

#: Radius of a cable of three wires, mm.
_RADIUS = 1.5


def card(robot: Robot) -> Manifold:
    """Return the Mega on its posts: board, USB socket, supply's socket and rows of pins."""
    m = dimensions().mega
    low = foot_floor(robot) + m.post
    top, half, wide = low + 1.6, m.length / 2, m.width / 2
    usb = wide - m.usb[0]
    holes = [disc("z", place, (low - 1, top + 1), 1.6) for place in card_screws()]
    board = cut(box((-half, half), (-wide, wide), (low, top)), holes)
    return join(
        [
            board,
            box((-half - 6.0, -half + 10.0), (usb - 6.0, usb + 6.0), (top, top + 10.5)),
            box((-half - 2.0, -half + 12.0), (-wide + 3.0, -wide + 12.0), (top, top + 10.5)),
            box((-half + 22.0, half - 12.0), (wide - 3.6, wide - 1.2), (top, top + 8.5)),
            box((-half + 22.0, half - 12.0), (-wide + 1.2, -wide + 3.6), (top, top + 8.5)),
            box((half - 10.0, half - 5.0), (-wide + 8.0, wide - 8.0), (top, top + 8.5)),
        ]
    )


def ballast(robot: Robot) -> Manifold:
    """Return the bags of steel in the foot's side chambers, as they lie."""
    inner = 1000 * robot.shape.pedestal_radius - dimensions().wall.shell - 3.0
    rib = dimensions().mega.width / 2 + dimensions().wall.shell + 4.0
    low = foot_floor(robot)
    posts = [disc("z", place, (low - 1, low + 40), 6.0) for place in lid_screws(robot)]
    room = disc("z", (0, 0), (low, low + 13.0), inner)
    return join([cut(room ^ box((-38, 38), (s * rib, s * 99), (low, 0)), posts) for s in (-1, 1)])


def buffer_board(robot: Robot) -> Manifold:
    """Return the buffer's board, which stands in the two grooves at the front of the foot."""
    x, low = dimensions().mega.length / 2 + 2.2, foot_floor(robot)
    board = box((x, x + 1.6), (-18.7, 18.7), (low, low + 18.0))
    return join([board, box((x + 1.6, x + 6.0), (-9.0, 9.0), (low + 4.0, low + 12.0))])


def hub_board(robot: Robot) -> Manifold:
    """Return the hub's board, which stands in the torso's two grooves at its back."""
    low = hub_floor(robot)
    board = box((-24.8, -23.2), (-17.2, 17.2), (low, low + 28.0))
    sockets = [
        box((-23.2, -17.0), (y - 4.8, y + 4.8), (low + 12.0, low + 26.0)) for y in (-10.5, 0, 10.5)
    ]
    return join([board, *sockets, box((-23.2, -15.0), (-7.0, 7.0), (low + 1.5, low + 9.0))])


def _socket(robot: Robot, joint: str, side: float) -> tuple[Point, Point]:
    """Return points at a servo's socket and behind it; ``side`` is the sign of the socket's x."""
    s, mount = dimensions().servo, mount_of(robot, joint)
    plug, free = (
        (f"{joint} servo", mount.link, mount.frame @ [side * 8.0, y, 9.2, 1.0])
        for y in ((s.socket_y[0] + s.socket_y[1]) / 2, s.back - s.plug_room)
    )
    return plug, free


def cables(robot: Robot) -> dict[str, list[Point]]:
    """Return the route of each servo's cable, by joint, and of the hub's own cable, ``feed``."""
    low, roof, stands = foot_floor(robot), neck_floor(robot), hub_floor(robot)
    front = dimensions().mega.length / 2 + 2.0
    plug, free = _socket(robot, "waist", 1.0)
    hub: list[Point] = [
        ("torso", "torso", (-17.0, y, stands + z))
        for y, z in ((-10.5, 19.0), (0.0, 19.0), (10.5, 19.0), (0.0, 5.0))
    ]
    found: dict[str, list[Point]] = {
        "waist": [
            plug, free, ("column", BASE, (2.0, -8.0, low + 26.0)),
            ("foot", BASE, (front - 8.0, -7.0, low + 17.0)),
            ("foot", BASE, (front, -7.0, low + 9.0)),
        ],
        "feed": [
            ("foot", BASE, (front, 7.0, low + 9.0)),
            ("foot", BASE, (front - 8.0, 7.0, low + 17.0)),
            ("column", BASE, (14.9, 0.0, low + 26.0)), ("column", BASE, (14.9, 0.0, 6.0)),
            ("torso", "torso", (2.0, 0.0, 16.0)),
            ("torso", "torso", (-14.0, 0.0, stands - 4.0)), hub[3],
        ],
    }  # fmt: skip
    found |= _arm_cables(robot, "right", -1.0, hub[0]) | _arm_cables(robot, "left", 1.0, hub[2])
    plug, free = _socket(robot, "head", 1.0)
    found["head"] = [
        plug, free, ("neck", "torso", (-10.5, -27.0, roof + 9.0)),
        ("neck", "torso", (-10.5, 0.0, roof + 7.0)), ("neck", "torso", (-8.0, 0.0, roof - 10.0)),
        ("torso", "torso", (-14.0, 0.0, stands + 31.0)), hub[1],
    ]  # fmt: skip
    return found


def _arm_cables(robot: Robot, side: str, sign: float, hub: Point) -> dict[str, list[Point]]:
    """Return the cables of an arm, starting at the hub; ``sign`` is the sign of y on its side."""
    high, span = 1000 * robot.lengths.L01, 1000 * robot.lengths.L23
    shoulder, elbow, fingertip = (f"{side}_{name}" for name in ("shoulder", "elbow", "fingertip"))
    arm, yoke = f"{side}_upper_arm", f"{side}_yoke"

    def at(thing: str, link: str, x: float, y: float, z: float) -> Point:
        return thing, link, (x, sign * y, z)

    # The arms are mirror images of each other, but servos are not, so their two sockets change
    # sides.
    front, front_free = _socket(robot, shoulder, -sign)
    back, back_free = _socket(robot, shoulder, sign)
    inner, inner_free = _socket(robot, elbow, sign)
    outer, outer_free = _socket(robot, elbow, -sign)
    upper, upper_free = _socket(robot, fingertip, -sign)
    return {
        shoulder: [
            front, front_free, at("torso", "torso", 8.0, 3.0, high - 28.0),
            at("torso", "torso", -8.0, 8.0, high - 29.0), hub,
        ],
        elbow: [
            back, back_free, at("torso", "torso", -20.0, 5.0, high - 8.0),
            at("torso", "torso", -22.0, 34.0, high - 8.0),
            at(yoke, shoulder, -22.0, -24.0, 0.0), at(yoke, shoulder, -20.0, -12.0, 6.0),
            inner_free, inner,
        ],
        fingertip: [
            outer, outer_free, at(yoke, shoulder, -22.0, 17.0, 2.0),
            at(arm, arm, -22.0, span / 2, 8.0), upper_free, upper,
        ],
    }  # fmt: skip


def wire(points: Sequence[Array]) -> Manifold:
    """Return a cable through points of one frame."""
    legs = [rod(a, b, _RADIUS) for a, b in pairwise(points) if np.linalg.norm(a - b) > 1e-6]
    return join([*legs, *(ball(point, _RADIUS) for point in points)])
