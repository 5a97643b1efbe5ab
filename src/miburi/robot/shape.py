"""Links and parts: which link turns about which joint, and which solids it consists of.

A robot's description yields two tables. The physical model, the URDF file and the robot on the
studio's pages are made from them. At zero angles the arms point straight out to the sides and the
head link points forward.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin

from miburi.robot.description import JOINTS, Array, Robot
from miburi.robot.geometry import head_joint, shoulders

Point = tuple[float, float, float]

#: The link that stands on the table, by the name that ROS gives it (REP-105).
BASE = "base_link"

#: Colours as red, green, blue, alpha; warm and quiet (our choice).
COLOURS = {
    "cream": (0.95, 0.91, 0.84, 1.0),
    "coral": (0.93, 0.50, 0.40, 1.0),
    "clay": (0.58, 0.44, 0.38, 1.0),
    "graphite": (0.13, 0.14, 0.16, 1.0),
    "screen": (0.66, 0.71, 0.71, 1.0),
    "skin": (0.86, 0.67, 0.55, 1.0),
}


@dataclass(frozen=True)
class Link:
    """A rigid link.

    Attributes
    ----------
    name, parent
        Its name, and the link that carries it.
    joint
        The joint that moves it.
    position, axis
        Where that joint is on the parent, in m, and the unit vector along its axis.
    """

    name: str
    parent: str
    joint: str
    position: Point
    axis: Point


@dataclass(frozen=True)
class LinkFrame:
    """The pose of a link on its parent.

    Attributes
    ----------
    parent, child
        The links' names.
    position, turn
        The position in m, and the rotation as a unit quaternion x, y, z, w.
    """

    parent: str
    child: str
    position: Point
    turn: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Part:
    """A simple solid on a link.

    Attributes
    ----------
    link, name
        The link that carries it, and its own name.
    kind
        ``sphere`` (size: radius), ``capsule`` or ``cylinder`` (radius; from ``position`` to
        ``end``), ``box`` (half sizes), ``ellipsoid`` (half axes, of which x and y are equal).
    tilt
        The angle by which a box is turned about the link's −y axis, in rad; only boxes are turned.
    mass
        The mass in kg; 0 for a part that is only drawn.
    """

    link: str
    name: str
    kind: str
    size: tuple[float, ...]
    position: Point
    colour: str
    mass: float = 0.0
    end: Point | None = None
    tilt: float = 0.0

    @property
    def of_the_phone(self) -> bool:
        """Whether it is a part of the phone; other parts can be drawn with their printed shapes."""
        return self.name.startswith(("phone", "screen"))

    @property
    def middle(self) -> Point:
        """The part's centre of mass, in m in the link's frame."""
        if self.end is None:
            return self.position
        (a, b, c), (d, e, f) = self.position, self.end
        return (a + d) / 2, (b + e) / 2, (c + f) / 2


def links(robot: Robot) -> list[Link]:
    """Return the links from the base outwards; their joints have the names in ``JOINTS``."""
    size = robot.lengths
    down_the_side: Point = (0.0, -1.0, 0.0)  # shoulders and head turn about it
    along: Point = (1.0, 0.0, 0.0)
    table = [
        Link("torso", BASE, "waist", (0, 0, 0), (0, 0, 1)),
        Link("head", "torso", "head", _point(head_joint(robot)), down_the_side),
    ]
    for side, sign, shoulder in zip(
        ("right", "left"), (-1.0, 1.0), map(_point, shoulders(robot)), strict=True
    ):
        elbow: Point = (0, sign * size.L23, 0)
        table += [
            Link(f"{side}_shoulder", "torso", f"{side}_shoulder", shoulder, down_the_side),
            Link(f"{side}_upper_arm", f"{side}_shoulder", f"{side}_elbow", (0, 0, 0), along),
            Link(f"{side}_forearm", f"{side}_upper_arm", f"{side}_fingertip", elbow, along),
        ]
    return table


def _point(place: Array) -> Point:
    x, y, z = place.tolist()
    return x, y, z


def extremities(robot: Robot) -> dict[str, tuple[str, Point]]:
    """Return, for right, left and head, the link and the extremity's position on it, in m."""
    size = robot.lengths
    return {
        "right": ("right_forearm", (0, -size.L34, 0)),
        "left": ("left_forearm", (0, size.L34, 0)),
        "head": ("head", (size.LH2, 0, 0)),
    }


def frames(moved: Sequence[Link], angles: Sequence[float]) -> list[LinkFrame]:
    """Return each link's frame for ``angles``, (8,) in rad, in the order of ``JOINTS``."""
    turns = dict(zip(JOINTS, angles, strict=True))

    def turn(link: Link) -> tuple[float, float, float, float]:
        half = turns[link.joint] / 2
        x, y, z = (sin(half) * part for part in link.axis)
        return x, y, z, cos(half)

    return [LinkFrame(link.parent, link.name, link.position, turn(link)) for link in moved]


def fixed_frames(robot: Robot) -> list[LinkFrame]:
    """Return the frames of hands and head, which do not move on their links."""
    return [
        LinkFrame(link, "head_centre" if name == "head" else name, point)
        for name, (link, point) in extremities(robot).items()
    ]


def parts(robot: Robot) -> list[Part]:
    """Return every solid of the robot."""
    size, shape, mass = robot.lengths, robot.shape, robot.masses
    floor = -shape.pedestal_height
    r, foot = shape.torso_radius, shape.pedestal_radius
    # The yoke ends short of the hanging upper arms; the shoulder balls cover the gap.
    yoke = size.L12 - shape.arm_radius - 0.4 * r - 0.002
    table = [
        Part(
            BASE, "foot", "cylinder", (foot,), (0, 0, floor), "clay",
            0.4, (0, 0, floor + 0.016),
        ),
        Part(
            BASE, "dome", "ellipsoid", (0.94 * foot, 0.94 * foot, 0.017), (0, 0, floor + 0.017),
            "clay",
        ),
        # A capsule's round end would reach below the foot.
        Part(BASE, "stem", "cylinder", (0.6 * r,), (0, 0, floor + 0.016), "clay", 0.1, (0, 0, 0)),
        Part(
            "torso", "trunk", "capsule", (r,), (0, 0, 0.012), "cream",
            0.8 * mass.torso, (0, 0, size.L01 - 0.4 * r),
        ),
        Part(
            "torso", "yoke", "capsule", (0.4 * r,), (0, -yoke, size.L01), "cream",
            0.2 * mass.torso, (0, yoke, size.L01),
        ),
        Part("torso", "belt", "cylinder", (1.03 * r,), (0, 0, 0.030), "coral", 0, (0, 0, 0.036)),
        Part(
            "torso", "collar", "ellipsoid", (0.62 * r, 0.62 * r, 0.006),
            (0, 0, size.L01 + 0.46 * r), "coral",
        ),
        Part(
            "torso", "neck", "capsule", (0.011,), (0, 0, size.L01), "clay",
            0.01, (0, 0, size.L01 + size.LH1 - 0.008),
        ),
        Part("head", "nod", "capsule", (0.011,), (0, 0, 0), "clay", 0.01, (size.LH2 - 0.012, 0, 0)),
        *_phone(robot),
    ]  # fmt: skip
    for side, sign in (("right", -1.0), ("left", 1.0)):
        arm, hand = shape.arm_radius, shape.hand_radius
        elbow, tip = (0, sign * size.L23, 0), (0, sign * size.L34, 0)
        table += [
            Part(
                f"{side}_shoulder", f"{side}_ball", "sphere", (1.45 * arm,), (0, 0, 0), "coral",
                mass.shoulder,
            ),
            Part(
                f"{side}_upper_arm", f"{side}_upper", "capsule", (arm,), (0, 0, 0), "cream",
                mass.upper_arm, elbow,
            ),
            Part(
                f"{side}_forearm", f"{side}_lower", "capsule", (0.92 * arm,), (0, 0, 0), "cream",
                0.6 * mass.forearm, tip,
            ),
            Part(f"{side}_forearm", f"{side}_joint", "sphere", (1.12 * arm,), (0, 0, 0), "coral"),
            Part(
                f"{side}_forearm", f"{side}_hand", "sphere", (hand,), tip, "coral",
                0.4 * mass.forearm,
            ),
        ]  # fmt: skip
    return table


def _phone(robot: Robot) -> list[Part]:
    """Return the phone: a slab with round corners, and a lit, empty screen on its front."""
    shape = robot.shape
    half = (shape.phone_thickness / 2, shape.phone_width / 2, shape.phone_height / 2)
    corner = 0.16 * shape.phone_width
    edge = 0.05 * shape.phone_width
    glass = (0.002, half[1] - edge, half[2] - edge)
    return [
        *_slab(robot, "phone", half, 0.0, corner, "graphite", robot.masses.phone),
        *_slab(robot, "screen", glass, half[0] - 0.0015, corner - edge, "screen", 0.0),
    ]


def _slab(
    robot: Robot, name: str, half: Point, ahead: float, corner: float, colour: str, mass: float
) -> list[Part]:
    """Return a box with round corners, tilted like the phone: two crossing boxes and four discs.

    The box's centre is ``ahead`` m in front of the phone's; ``corner`` is its corners' radius in m.
    """
    tilt = -robot.shape.phone_level
    deep, wide, high = half
    normal, up = (cos(tilt), sin(tilt)), (-sin(tilt), cos(tilt))

    above = robot.shape.phone_height / 2 - robot.shape.phone_drop

    def at(depth: float, side: float, height: float) -> Point:
        return (
            robot.lengths.LH2 + depth * normal[0] + (height + above) * up[0],
            side,
            depth * normal[1] + (height + above) * up[1],
        )

    # Two faces in one plane would flicker, so the other solids are a little thinner.
    thin = 0.95 * deep
    boxes = {name: (deep, wide - corner, high), f"{name}_sides": (thin, wide, high - corner)}
    discs = {
        f"{name}_{row}_{side}": (y * (wide - corner), z * (high - corner))
        for row, z in (("top", 1), ("bottom", -1))
        for side, y in (("right", -1), ("left", 1))
    }
    share = mass / 2
    return [
        *(
            Part("head", box, "box", size, at(ahead, 0, 0), colour, share, tilt=tilt)
            for box, size in boxes.items()
        ),
        *(
            Part(
                "head", disc, "cylinder", (corner,), at(ahead - thin, y, z), colour,
                0, at(ahead + thin, y, z),
            )
            for disc, (y, z) in discs.items()
        ),
    ]  # fmt: skip
