"""Links and parts: what turns about which joint, and what it is made of.

The physical model, the URDF file and the pages that draw the robot are all made from these two
tables. At zero angles the arms point straight out sideways and the head link points forward.
"""

from dataclasses import dataclass
from math import cos, sin

from miburi.robot.description import Robot

Point = tuple[float, float, float]

#: Colours as red, green, blue, alpha; warm and quiet (ours).
COLOURS = {
    "cream": (0.95, 0.91, 0.84, 1.0),
    "coral": (0.93, 0.50, 0.40, 1.0),
    "clay": (0.58, 0.44, 0.38, 1.0),
    "graphite": (0.13, 0.14, 0.16, 1.0),
    "screen": (0.05, 0.07, 0.10, 1.0),
    "skin": (0.86, 0.67, 0.55, 1.0),
}


@dataclass(frozen=True)
class Link:
    """A rigid link: its parent, the joint that moves it, where and about which axis."""

    name: str
    parent: str
    joint: str
    position: Point
    axis: Point


@dataclass(frozen=True)
class Part:
    """A simple solid on a link.

    Attributes
    ----------
    link, name
        The link that carries it, and its own name.
    kind
        ``sphere`` (size: radius), ``capsule`` or ``cylinder`` (radius; from ``position`` to
        ``end``), ``box`` (half sizes), ``ellipsoid`` (half axes).
    tilt
        Turn about the link's −y axis, in rad; boxes and ellipsoids only.
    mass
        kg; 0 for what is only seen.
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


def links(robot: Robot) -> list[Link]:
    """Return the links from the base outwards; each joint name is the paper's order's."""
    size = robot.lengths
    down_the_side: Point = (0.0, -1.0, 0.0)  # shoulders and head nod about the robot's right
    along: Point = (1.0, 0.0, 0.0)
    table = [
        Link("torso", "base", "waist", (0, 0, 0), (0, 0, 1)),
        Link("head", "torso", "head", (0, 0, size.L01 + size.LH1), down_the_side),
    ]
    for side, sign in (("right", -1.0), ("left", 1.0)):
        shoulder: Point = (0, sign * size.L12, size.L01)
        elbow: Point = (0, sign * size.L23, 0)
        table += [
            Link(f"{side}_shoulder", "torso", f"{side}_shoulder", shoulder, down_the_side),
            Link(f"{side}_upper_arm", f"{side}_shoulder", f"{side}_elbow", (0, 0, 0), along),
            Link(f"{side}_forearm", f"{side}_upper_arm", f"{side}_fingertip", elbow, along),
        ]
    return table


def extremities(robot: Robot) -> dict[str, tuple[str, Point]]:
    """Return where the nine coordinates are measured: link and point for right, left and head."""
    size = robot.lengths
    return {
        "right": ("right_forearm", (0, -size.L34, 0)),
        "left": ("left_forearm", (0, size.L34, 0)),
        "head": ("head", (size.LH2, 0, 0)),
    }


def parts(robot: Robot) -> list[Part]:
    """Return every solid of the robot."""
    size, shape, mass = robot.lengths, robot.shape, robot.masses
    floor = -shape.pedestal_height
    r = shape.torso_radius
    # The yoke ends short of the hanging upper arms; the shoulder balls cover the gap.
    yoke = size.L12 - shape.arm_radius - 0.4 * r - 0.002
    table = [
        Part(
            "base", "foot", "cylinder", (shape.pedestal_radius,), (0, 0, floor), "clay",
            0.4, (0, 0, floor + 0.016),
        ),
        Part("base", "stem", "capsule", (0.6 * r,), (0, 0, floor + 0.016), "clay", 0.1, (0, 0, 0)),
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
    """Return the phone: a body with rounded ends and a screen on its front face."""
    shape, mass = robot.shape, robot.masses
    tilt = -shape.phone_level
    half = (shape.phone_thickness / 2, shape.phone_width / 2, shape.phone_height / 2)
    centre: Point = (robot.lengths.LH2, 0, 0)
    ahead = half[0] + 0.0002
    screen: Point = (centre[0] + ahead * cos(tilt), 0, ahead * sin(tilt))
    glass = (0.0004, half[1] - 0.0035, half[2] - 0.0035)
    return [
        Part("head", "phone", "box", half, centre, "graphite", mass.phone, tilt=tilt),
        Part("head", "screen", "box", glass, screen, "screen", tilt=tilt),
    ]
