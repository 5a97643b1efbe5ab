"""Make the physical model: turn the description into MJCF for MuJoCo."""

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from miburi.robot.description import JOINTS, Robot
from miburi.robot.shape import BASE, COLOURS, Link, Part, extremities, links, parts
from miburi.servos import Servo

__all__ = [
    "FACE_PIXELS",
    "HAND_AWAY",
    "HAND_MASS",
    "HAND_SIZE",
    "HORN",
    "PLAY",
    "TIMESTEP",
    "to_mjcf",
]

#: The share of a servo's dry friction that acts at the horn, behind the backlash (our choice).
#: Without it, an unloaded joint would swing within the backlash for ever.
HORN = 0.1
#: The stiffness of the teeth where the play ends; with MuJoCo's defaults it would be as low as a
#: servo's.
_TEETH = "0.99 0.999 0.0001"
#: Prefix of the joints that stand for the play of a servo's gears.
PLAY = "play_"
#: Physics runs at 500 Hz.
TIMESTEP = 0.002
#: Side length of the face on the screen, in pixels.
FACE_PIXELS = 192
#: Position of the human hand while nobody reaches for the robot, m.
HAND_AWAY = (0.45, -0.35, 0.10)
#: The human hand is a capsule: its radius, and half of its length (a finger or two), m.
HAND_SIZE = (0.016, 0.045)
#: Mass of the sprung hand, kg: that of a hand in ISO/TS 15066's body model.
HAND_MASS = 0.6
#: The wall behind the table: warm and light.
_WALL = (0.93, 0.90, 0.86, 1.0)


def to_mjcf(
    robot: Robot,
    meshes: Mapping[tuple[str, str], str] | None = None,
    *,
    face: bool = False,
    sprung_hand: bool = False,
) -> str:
    """Return the robot on a table, with position servos and a movable human hand, as MJCF.

    Joints and actuators have the names in ``JOINTS``; the sites ``right``, ``left`` and ``head``
    mark the extremities. Where servo gears have play, a joint ``play_…`` lies between each motor
    and what it moves; its limits are the gears' teeth. All pairs of parts can collide, except those
    that a joint connects.

    The mocap body ``hand`` collides with the robot only. A ``sprung_hand`` has mass, hangs on a
    spring along each axis (joints ``hand_x``, ``hand_y``, ``hand_z``) and can grasp, by the
    equality constraint ``grasp``. With ``face`` the screen carries a square of the material
    ``face``, whose
    texture can be drawn on. ``meshes`` are the files of the real shapes, in mm, by link and colour:
    with them, the real shapes and the phone are drawn, and the simple shapes that collide are in
    group 3, which viewers hide.
    """
    root = ET.Element("mujoco", model=robot.name)
    ET.SubElement(root, "compiler", angle="radian", autolimits="true")
    ET.SubElement(
        root, "option", timestep=str(TIMESTEP), integrator="implicitfast", cone="elliptic"
    )
    visual = ET.SubElement(root, "visual")
    ET.SubElement(visual, "global", offwidth="1280", offheight="960", fovy="35")
    ET.SubElement(visual, "quality", shadowsize="1024", offsamples="4")
    ET.SubElement(
        visual, "headlight", ambient="0.42 0.41 0.40", diffuse="0.25 0.25 0.25", specular="0 0 0"
    )
    # The table fades into the wall, so that only the robot stands out.
    ET.SubElement(visual, "map", znear="0.01", zfar="30", haze="0.85", shadowscale="0.5")
    ET.SubElement(visual, "rgba", haze=_text(_WALL))
    asset = ET.SubElement(root, "asset")
    for name, colour in COLOURS.items():
        shine, glow = {"graphite": (0.5, 0.0), "screen": (0.1, 0.45)}.get(name, (0.25, 0.0))
        ET.SubElement(
            asset, "material", name=name, rgba=_text(colour), specular=str(shine),
            shininess="0.5", emission=str(glow),
        )  # fmt: skip
    ET.SubElement(
        asset, "texture", name="sky", type="skybox", builtin="flat",
        rgb1=_text(_WALL[:3]), width="8", height="8",
    )  # fmt: skip
    ET.SubElement(
        asset, "material", name="table", rgba="0.84 0.80 0.75 1", specular="0.05", reflectance="0"
    )
    world = ET.SubElement(root, "worldbody")
    ET.SubElement(
        world, "light", directional="true", castshadow="true", pos="0.6 -0.5 1.2",
        dir="-0.5 0.4 -1", diffuse="0.55 0.53 0.50", specular="0.15 0.15 0.15",
    )  # fmt: skip
    ET.SubElement(
        world, "light", directional="true", castshadow="false", pos="0.3 0.8 0.7",
        dir="-0.3 -0.8 -0.5", diffuse="0.22 0.22 0.25", specular="0 0 0",
    )  # fmt: skip
    ET.SubElement(
        world, "geom", name="table", type="plane", size="0 0 0.1", material="table",
        pos=_text((0, 0, -robot.shape.pedestal_height)), contype="0", conaffinity="1",
    )  # fmt: skip
    bodies = {BASE: ET.SubElement(world, "body", name=BASE)}
    for link in links(robot):
        bodies[link.name] = _body(bodies[link.parent], link, robot)
    for part in parts(robot):
        shown = meshes is None or part.of_the_phone
        if shown or part.mass:
            _geom(bodies[part.link], part, hidden=not shown)
    for (link_name, material), file in (meshes or {}).items():
        name = f"{link_name}_{material}"
        ET.SubElement(asset, "mesh", name=name, file=file, scale="0.001 0.001 0.001")
        ET.SubElement(
            bodies[link_name], "geom", type="mesh", mesh=name, material=material, mass="0",
            contype="0", conaffinity="0",
        )  # fmt: skip
    for name, (link_name, point) in extremities(robot).items():
        ET.SubElement(
            bodies[link_name], "site", name=name, pos=_text(point), size="0.002", group="4"
        )
    if sprung_hand:
        _sprung_hand(root, world)
    else:
        _hand(world)
    if face:
        _face(robot, asset, bodies["head"])
    # MuJoCo itself ignores contacts between bodies that a joint connects, unless one is fixed to
    # the world.
    ET.SubElement(ET.SubElement(root, "contact"), "exclude", body1=BASE, body2="torso")
    actuator = ET.SubElement(root, "actuator")
    servo = robot.servo.model
    for joint in JOINTS:
        ET.SubElement(
            actuator, "position", name=joint, joint=joint,
            kp=str(servo.stiffness), kv=str(servo.control_damping),
            forcerange=_text((-servo.motor_torque, servo.motor_torque)),
        )  # fmt: skip
    _horns(root, servo)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def _horns(root: ET.Element, servo: Servo) -> None:
    """Add friction on the output side of gears with backlash, by a tendon over both joints."""
    if not servo.loop.backlash:
        return
    tendons = ET.SubElement(root, "tendon")
    friction = servo.friction
    for joint in JOINTS:
        horn = ET.SubElement(
            tendons, "fixed", name=f"horn_{joint}",
            frictionloss=str(HORN * (friction.dry + friction.stiction)),
            solreffriction=f"{friction.solver_time} 1",
            solimpfriction=f"{friction.solver_grip} {max(friction.solver_grip, 0.95)}",
        )  # fmt: skip
        for name in (joint, PLAY + joint):
            ET.SubElement(horn, "joint", joint=name, coef="1")


def _body(parent: ET.Element, link: Link, robot: Robot) -> ET.Element:
    body = ET.SubElement(parent, "body", name=link.name, pos=_text(link.position))
    index, servo = JOINTS.index(link.joint), robot.servo.model
    grip = servo.friction.solver_grip
    ET.SubElement(
        body, "joint", name=link.joint, type="hinge", axis=_text(link.axis),
        range=_text((robot.lower[index], robot.upper[index])), armature=str(servo.motor.armature),
        damping=str(servo.damping), frictionloss=str(servo.friction.dry + servo.friction.stiction),
        solreffriction=f"{servo.friction.solver_time} 1",
        solimpfriction=f"{grip} {max(grip, 0.95)}",
    )  # fmt: skip
    if servo.loop.backlash:
        ET.SubElement(
            body, "joint", name=PLAY + link.joint, type="hinge", axis=_text(link.axis),
            range=_text((-servo.loop.backlash / 2, servo.loop.backlash / 2)),
            solreflimit=f"{2 * TIMESTEP} 1", solimplimit=_TEETH,
        )  # fmt: skip
    return body


def _geom(body: ET.Element, part: Part, *, hidden: bool = False) -> None:
    geom = ET.SubElement(body, "geom", name=part.name, type=part.kind, material=part.colour)
    if hidden:
        geom.set("group", "3")
    if part.end is not None:
        geom.set("fromto", _text((*part.position, *part.end)))
    else:
        geom.set("pos", _text(part.position))
    geom.set("size", _text(part.size))
    if part.tilt:
        geom.set("axisangle", _text((0, -1, 0, part.tilt)))
    if part.mass:
        geom.set("mass", str(part.mass))
    else:
        geom.attrib |= {"mass": "0", "contype": "0", "conaffinity": "0"}


def _hand(world: ET.Element) -> None:
    """Add the human hand as a body that the program places."""
    hand = ET.SubElement(world, "body", name="hand", mocap="true", pos=_text(HAND_AWAY))
    _fingers(hand, {})


def _sprung_hand(root: ET.Element, world: ET.Element) -> None:
    """Add the human hand on springs, which yield as an arm does; its joints are world positions."""
    hand = ET.SubElement(world, "body", name="hand", gravcomp="1", pos=_text(HAND_AWAY))
    for name, axis, away in zip("xyz", np.eye(3), HAND_AWAY, strict=True):
        ET.SubElement(
            hand, "joint", name=f"hand_{name}", type="slide", axis=_text(tuple(axis)),
            ref=str(away), springref=str(away), stiffness="1000", damping="30",
        )  # fmt: skip
    _fingers(hand, {"mass": str(HAND_MASS), "priority": "1"})
    ET.SubElement(
        ET.SubElement(root, "equality"), "connect", name="grasp", body1="hand",
        body2="right_forearm", anchor="0 0 0", active="false", solref="0.004 1",
    )  # fmt: skip


def _fingers(hand: ET.Element, attributes: dict[str, str]) -> None:
    """Add the part of the hand that can touch."""
    radius, half = HAND_SIZE
    ET.SubElement(
        hand, "geom", attributes, name="hand", type="capsule", material="skin",
        size=_text((radius, half)), contype="2", conaffinity="1",
    )  # fmt: skip


def _face(robot: Robot, asset: ET.Element, head: ET.Element) -> None:
    """Add a square as wide as the phone's screen, and the textures of square and screen."""
    for name, pixels in (("face", str(FACE_PIXELS)), ("tint", "4")):
        ET.SubElement(
            asset, "texture", name=name, type="cube", builtin="flat", rgb1="1 1 1",
            width=pixels, height=pixels,
        )  # fmt: skip
    # Both take their colour from a texture, so that light changes both in the same way. With a
    # colour of 0.8 a lit texture keeps its colour.
    for material in asset.findall("material[@name='screen']"):
        material.attrib |= {"texture": "tint", "rgba": "0.8 0.8 0.8 1"}
        ET.SubElement(asset, "material", material.attrib | {"name": "face", "texture": "face"})
    screen = next(part for part in parts(robot) if part.name == "screen")
    deep, half = screen.size[0], 0.45 * robot.shape.phone_width
    _geom(head, replace(screen, name="face", colour="face", size=(1.05 * deep, half, half)))


def _text(numbers: tuple[float, ...]) -> str:
    return " ".join(np.format_float_positional(number, trim="-") for number in numbers)
