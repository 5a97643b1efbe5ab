"""The head's printed parts: the neck with the head's servo, the phone's cradle and its jaw.

The neck is in the torso's frame. Cradle and jaw are in the head's frame: x from the axle to the
head's centre, y to the robot's left, in mm. ``fit`` is the gap on each side of a pocket.
"""

from dataclasses import dataclass
from itertools import product
from math import cos, sin

import numpy as np

from miburi.hardware import servo
from miburi.hardware.dimensions import dimensions
from miburi.hardware.places import mount_of, neck_floor, range_of
from miburi.hardware.solids import Manifold, ball, box, cut, discs, hull, join, moved, rod
from miburi.hardware.trunk import NECK_SCREWS
from miburi.robot import Robot
from miburi.robot.description import Array

#: The thickness of the cradle's plate, the thickness of the foam behind the phone, and by how much
#: a phone may be narrower than the cradle, all in mm.
_PLATE, _FOAM, _TRAVEL = 3.0, 1.0, 7.5
#: Thickness of the neck's flange, mm.
NECK_FLANGE = 3.0


@dataclass(frozen=True)
class Clamp:
    """The place of the phone, relative to the head's axle, mm.

    Attributes
    ----------
    frame
        The phone's frame on the head's link, with shape (3, 4): x points out of the screen, y to
        the robot's left, z up along the phone.
    plate
        Where the cradle's plate begins, along x.
    back, front
        The phone's back and its screen, along x.
    low, high
        The phone's lower and upper edge, along z.
    half
        Half the phone's width.
    """

    frame: Array
    plate: float
    back: float
    front: float
    low: float
    high: float
    half: float


def clamp(robot: Robot) -> Clamp:
    """Return where the phone is held."""
    shape, far = robot.shape, 1000 * robot.lengths.LH2
    level = shape.phone_level
    ahead, above = far * cos(level), far * sin(level)
    half_thick = 500 * shape.phone_thickness
    frame = np.array(
        [[cos(level), 0.0, sin(level), 0.0], [0.0, 1.0, 0.0, 0.0],
         [-sin(level), 0.0, cos(level), 0.0]]
    )  # fmt: skip
    low = above - 1000 * shape.phone_drop
    return Clamp(
        frame, ahead - half_thick - _FOAM - _PLATE, ahead - half_thick, ahead + half_thick,
        low, low + 1000 * shape.phone_height, 500 * shape.phone_width,
    )  # fmt: skip


def phone(robot: Robot) -> Manifold:
    """Return the phone itself, on the head's link."""
    c = clamp(robot)
    return moved(box((c.back, c.front), (-c.half, c.half), (c.low, c.high)), c.frame)


def neck(robot: Robot, fit: float) -> Manifold:
    """Return the neck: it stands on the torso and holds the head's servo tilted backwards."""
    s, w, holes = dimensions().servo, dimensions().wall, dimensions().screws
    frame = mount_of(robot, "head").frame
    level = robot.shape.phone_level
    ahead = np.array([cos(level), 0.0, -sin(level)])
    span = servo.cheek_span(frame, np.array([0.0, -1.0, 0.0]), ahead, range_of(robot, "head"))
    grip = moved(join([servo.holder(fit), servo.stops(*span, fit)]), frame)
    floor = neck_floor(robot)
    wide = s.half_width + fit + w.shell
    corners = list(product((-20.5, -1.0), (-20.0, 20.0)))
    base = hull(*discs("z", corners, (floor, floor + NECK_FLANGE), 4.0))
    end = s.long_end + fit
    # The neck's column begins where the sleeve of the servo ends, and leans with it.
    foot_of_sleeve = moved(box((-wide, wide), (s.back, s.front), (end, end + w.shell)), frame)
    column = hull(foot_of_sleeve, box((-24.0, 3.0), (-13.5, 13.5), (floor, floor + 1.0)))
    # The head's cable comes up through the roof and leaves on the robot's right, hence the bend.
    bend = (-10.5, 0.0, floor + 7.0)
    channel = [
        rod((-8.0, 0.0, floor - 6.0), bend, 5.0),
        rod(bend, (-10.5, -30.0, floor + 7.0), 5.0),
        ball(bend, 5.0),
    ]
    flange = discs("z", NECK_SCREWS, (floor - 1.0, floor + 9.0), holes.m25_clearance / 2)
    return cut(join([grip, base, column]), [moved(servo.pocket(fit), frame), *channel, *flange])


def cradle(robot: Robot) -> Manifold:
    """Return the part that nods: fork, plate behind the phone's lower third, shelf, fixed jaw."""
    c, holes = clamp(robot), dimensions().screws
    face = c.plate + _PLATE
    # The narrowest phone ends at this distance from the middle on the sliding jaw's side. The plate
    # ends before that, clear of the jaw's cheek.
    narrow = c.half - _TRAVEL
    lip = c.front + _FOAM
    grip = c.low + 50.0
    top = max(grip, 14.0)
    plate = _rounded((c.plate, face), (-narrow + 2.0, c.half + 3.0), (c.low - 3.0, top), 4.0)
    shelf = box((c.plate, lip + 2.5), (-narrow + 2.0, c.half + 3.0), (c.low - 3.0, c.low))
    hooks = [
        box((lip, lip + 2.5), sides, (c.low - 3.0, c.low + 12.0))
        for sides in ((13.0, c.half + 3.0), (-narrow + 2.0, -13.0))
    ]
    fixed = box((c.plate, lip + 2.5), (c.half, c.half + 3.0), (c.low - 3.0, grip))
    fixed_lip = box((lip, lip + 2.5), (c.half - 4.0, c.half + 3.0), (c.low - 3.0, grip))
    middle = (dimensions().servo.horn_face + dimensions().servo.idler_face) / 2
    fork = servo.cheeks(face).translate((0.0, -middle, 0.0))
    # The bridge is as near the axle as on the other forks: otherwise, with a longer link LH2, the
    # gap could pinch fingers.
    half, web = servo.fork_half_width(), dimensions().wall.web
    bridge = box((min(web, c.plate), face), (-half, half), (-10.0, 10.0))
    port = box((face, lip + 4.0), (-12.5, 12.5), (c.low - 4.0, c.low + 1.0))
    screws = discs("x", jaw_rows(robot), (c.plate - 1, face + 1), holes.m3_pilot / 2)
    whole = cut(join([fork, bridge, plate, shelf, *hooks, fixed, fixed_lip]), [port, *screws])
    return moved(whole, c.frame)


def jaw(robot: Robot) -> Manifold:
    """Return the jaw that slides: a tongue behind the cradle's plate, a cheek and a lip."""
    c, holes = clamp(robot), dimensions().screws
    narrow = c.half - _TRAVEL
    lip = c.front + _FOAM
    (_, low), (_, high) = jaw_rows(robot)
    low, high = low - 6.0, high + 6.0
    back = c.plate - 3.2
    tongue = _rounded((back, c.plate - 0.2), (-c.half - 3.0, -narrow + 20.0), (low, high), 3.0)
    cheek = box((back, lip + 2.5), (-c.half - 3.0, -c.half), (low, high))
    hook = box((lip, lip + 2.5), (-c.half - 3.0, -c.half + 4.0), (low, high))
    wide = holes.m3_clearance / 2
    # The screws stay in the cradle; for a narrower phone the jaw slides inwards.
    slots = [
        hull(*discs("x", [(y - _TRAVEL, z), (y, z)], (back - 1, c.plate + 1), wide))
        for y, z in jaw_rows(robot)
    ]
    return moved(cut(join([tongue, cheek, hook]), slots), c.frame)


def jaw_rows(robot: Robot) -> list[tuple[float, float]]:
    """Return y and z of the jaw's two screws in the clamp's frame: above the fork's cheeks."""
    c = clamp(robot)
    return [(_TRAVEL - c.half + 12.0, c.low + height) for height in (33.0, 43.0)]


def _rounded(
    x: tuple[float, float], y: tuple[float, float], z: tuple[float, float], radius: float
) -> Manifold:
    """Return a plate perpendicular to x, with rounded corners."""
    sides, heights = ((low + radius, high - radius) for low, high in (y, z))
    return hull(*discs("x", list(product(sides, heights)), x, radius))
