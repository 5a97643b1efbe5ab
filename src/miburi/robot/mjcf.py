"""Make the physical model: turn the description into MJCF for MuJoCo."""

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from miburi.robot.description import JOINTS, Robot
from miburi.robot.shape import BASE, COLOURS, Link, Part, extremities, links, parts
from miburi.servos import Servo
from miburi.servos.servo import Friction

#: The share of a servo's dry friction that acts at the horn, behind the backlash (our choice).
#: Without it, an unloaded joint would swing within the backlash for ever.
HORN = 0.1
#: The stiffness of the teeth where the play ends; MuJoCo's default would be as low as a servo's
#: stiffness.
_TEETH = "0.99 0.999 0.0001"
#: Prefix of the joints that stand for the play of a servo's gears.
PLAY = "play_"
#: The physics' time step, in s.
TIMESTEP = 0.002
#: Side length of the face on the screen, in pixels.
FACE_PIXELS = 192
#: Position of the human hand while nobody reaches for the robot, in m.
HAND_AWAY = (0.45, -0.35, 0.10)
#: The human hand is a capsule, a finger or two: its radius, and half of its length, both in m.
HAND_SIZE = (0.016, 0.045)
#: Mass of the sprung hand, in kg: the mass of a hand in ISO/TS 15066's body model.
HAND_MASS = 0.6


def to_mjcf(
    robot: Robot,
    meshes: Mapping[tuple[str, str], str] | None = None,
    *,
    face: bool = False,
    sprung_hand: bool = False,
    alone: bool = False,
) -> str:
    """Return the robot on a table, with position servos and a movable human hand, as MJCF.

    ``alone`` is for other programs: table, lights and hand are left out, the actuators are in the
    order of the model's joints and take angles within their limits, and there is a keyframe
    ``neutral``.

    Joints and actuators have the names in ``JOINTS``; the sites ``right``, ``left`` and ``head``
    mark the extremities. Where servo gears have play, a joint ``play_…`` lies between each motor
    and what it moves; its limits are the gears' teeth. All pairs of parts can collide, except those
    that a joint connects.

    The mocap body ``hand`` collides with the robot only. A ``sprung_hand`` has mass, hangs on a
    spring along each axis (joints ``hand_x``, ``hand_y``, ``hand_z``) and can grasp, by the
    equality constraint ``grasp``. With ``face`` the screen carries a square of the material
    ``face``, whose texture can be drawn on. ``meshes`` are the files of the real shapes (in mm) by
    link and colour. If they are given, the real shapes and the phone are drawn; the simple shapes,
    which collide, are then in group 3, which viewers hide.
    """
    root = ET.Element("mujoco", model=robot.name)
    _add(root, "compiler", angle="radian", autolimits="true")
    _add(root, "option", timestep=TIMESTEP, integrator="implicitfast", cone="elliptic")
    asset, world = _add(root, "asset"), _add(root, "worldbody")
    _materials(asset)
    if not alone:
        root.extend(_room(robot))
    bodies = {BASE: _add(world, "body", name=BASE)}
    for link in links(robot):
        bodies[link.name] = _body(bodies[link.parent], link, robot)
    for part in parts(robot):
        shown = meshes is None or part.of_the_phone
        if shown or part.mass:
            _geom(bodies[part.link], part, hidden=not shown)
    for (link_name, material), file in (meshes or {}).items():
        name = f"{link_name}_{material}"
        _add(asset, "mesh", name=name, file=file, scale="0.001 0.001 0.001")
        _add(
            bodies[link_name], "geom", type="mesh", mesh=name, material=material, mass=0,
            contype=0, conaffinity=0,
        )  # fmt: skip
    for name, (link_name, point) in extremities(robot).items():
        _add(bodies[link_name], "site", name=name, pos=point, size=0.002, group=4)
    if sprung_hand:
        _sprung_hand(root, world)
    elif not alone:
        _fingers(_add(world, "body", name="hand", mocap="true", pos=HAND_AWAY))
    if face:
        _face(robot, asset, bodies["head"])
    # MuJoCo ignores contacts between bodies that a joint connects unless one is fixed to the world.
    _add(_add(root, "contact"), "exclude", body1=BASE, body2="torso")
    actuator, servo = _add(root, "actuator"), robot.servo.model
    for joint in [link.joint for link in links(robot)] if alone else JOINTS:
        index = JOINTS.index(joint)
        _add(
            actuator, "position", name=joint, joint=joint,
            kp=servo.stiffness, kv=servo.control_damping,
            forcerange=(-servo.motor_torque, servo.motor_torque),
            **({"ctrlrange": (robot.lower[index], robot.upper[index])} if alone else {}),
        )  # fmt: skip
    if servo.loop.backlash:
        _horns(root, servo)
    if alone:
        _neutral(root, robot)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def _materials(asset: ET.Element) -> None:
    for name, colour in COLOURS.items():
        shine, glow = {"graphite": (0.5, 0.0), "screen": (0.1, 0.45)}.get(name, (0.25, 0.0))
        _add(
            asset, "material", name=name, rgba=colour, specular=shine, shininess=0.5, emission=glow
        )


def _room(robot: Robot) -> ET.Element:
    """Return the table, the lights and how they are drawn."""
    # The table fades into the wall, which is warm and light, so that only the robot stands out.
    # S314 warns of untrusted XML, but this text is our own.
    return ET.fromstring(  # noqa: S314
        f"""<mujoco>
        <visual>
          <global offwidth="1280" offheight="960" fovy="35"/>
          <quality shadowsize="1024" offsamples="4"/>
          <headlight ambient="0.42 0.41 0.40" diffuse="0.25 0.25 0.25" specular="0 0 0"/>
          <map znear="0.01" zfar="30" haze="0.85" shadowscale="0.5"/>
          <rgba haze="0.93 0.9 0.86 1"/>
        </visual>
        <asset>
          <texture name="sky" type="skybox" builtin="flat" rgb1="0.93 0.9 0.86" width="8"
            height="8"/>
          <material name="table" rgba="0.84 0.80 0.75 1" specular="0.05" reflectance="0"/>
        </asset>
        <worldbody>
          <light directional="true" castshadow="true" pos="0.6 -0.5 1.2" dir="-0.5 0.4 -1"
            diffuse="0.55 0.53 0.50" specular="0.15 0.15 0.15"/>
          <light directional="true" castshadow="false" pos="0.3 0.8 0.7" dir="-0.3 -0.8 -0.5"
            diffuse="0.22 0.22 0.25" specular="0 0 0"/>
          <geom name="table" type="plane" size="0 0 0.1" material="table"
            pos="{_text((0, 0, -robot.shape.pedestal_height))}" contype="0" conaffinity="1"/>
        </worldbody>
        </mujoco>"""
    )


def _neutral(root: ET.Element, robot: Robot) -> None:
    """Add the keyframe: all joints at neutral, without play, and the motors told to stay there."""
    angles = tuple(robot.neutral[JOINTS.index(link.joint)] for link in links(robot))
    plays = (0.0,) if robot.servo.model.loop.backlash else ()
    places = tuple(value for angle in angles for value in (angle, *plays))
    _add(_add(root, "keyframe"), "key", name="neutral", qpos=places, ctrl=angles)


def _horns(root: ET.Element, servo: Servo) -> None:
    """Add friction on the output side of gears with backlash, by a tendon over both joints."""
    tendons = _add(root, "tendon")
    for joint in JOINTS:
        loss = HORN * (servo.friction.dry + servo.friction.stiction)
        horn = _add(
            tendons, "fixed", name=f"horn_{joint}", frictionloss=loss, **_solver(servo.friction)
        )
        for name in (joint, PLAY + joint):
            _add(horn, "joint", joint=name, coef=1)


def _solver(friction: Friction) -> dict[str, str]:
    """Return the parameters of MuJoCo's solver for dry friction."""
    grip = friction.solver_grip
    return {
        "solreffriction": f"{friction.solver_time} 1",
        "solimpfriction": f"{grip} {max(grip, 0.95)}",
    }


def _body(parent: ET.Element, link: Link, robot: Robot) -> ET.Element:
    body = _add(parent, "body", name=link.name, pos=link.position)
    index, servo = JOINTS.index(link.joint), robot.servo.model
    _add(
        body, "joint", name=link.joint, type="hinge", axis=link.axis,
        range=(robot.lower[index], robot.upper[index]), armature=servo.motor.armature,
        damping=servo.damping, frictionloss=servo.friction.dry + servo.friction.stiction,
        **_solver(servo.friction),
    )  # fmt: skip
    if servo.loop.backlash:
        _add(
            body, "joint", name=PLAY + link.joint, type="hinge", axis=link.axis,
            range=(-servo.loop.backlash / 2, servo.loop.backlash / 2),
            solreflimit=f"{2 * TIMESTEP} 1", solimplimit=_TEETH,
        )  # fmt: skip
    return body


def _geom(body: ET.Element, part: Part, *, hidden: bool = False) -> None:
    more: dict[str, object] = {"group": 3} if hidden else {}
    more |= {"pos": part.position} if part.end is None else {"fromto": part.position + part.end}
    more["size"] = part.size
    if part.tilt:
        more["axisangle"] = (0, -1, 0, part.tilt)
    more |= {"mass": part.mass} if part.mass else {"mass": 0, "contype": 0, "conaffinity": 0}
    _add(body, "geom", name=part.name, type=part.kind, material=part.colour, **more)


def _sprung_hand(root: ET.Element, world: ET.Element) -> None:
    """Add the human hand on springs, which yield as an arm does; its joints are in world axes."""
    hand = _add(world, "body", name="hand", gravcomp=1, pos=HAND_AWAY)
    for name, axis, away in zip("xyz", np.eye(3), HAND_AWAY, strict=True):
        _add(
            hand, "joint", name=f"hand_{name}", type="slide", axis=tuple(axis),
            ref=away, springref=away, stiffness=1000, damping=30,
        )  # fmt: skip
    _fingers(hand, mass=HAND_MASS, priority=1)
    _add(
        _add(root, "equality"), "connect", name="grasp", body1="hand", body2="right_forearm",
        anchor="0 0 0", active="false", solref="0.004 1",
    )  # fmt: skip


def _fingers(hand: ET.Element, **attributes: object) -> None:
    _add(
        hand, "geom", **attributes, name="hand", type="capsule", material="skin", size=HAND_SIZE,
        contype=2, conaffinity=1,
    )  # fmt: skip


def _face(robot: Robot, asset: ET.Element, head: ET.Element) -> None:
    """Add a square as wide as the phone's screen, and the textures of square and screen."""
    for name, pixels in (("face", FACE_PIXELS), ("tint", 4)):
        _add(
            asset, "texture", name=name, type="cube", builtin="flat", rgb1="1 1 1",
            width=pixels, height=pixels,
        )  # fmt: skip
    # Face and screen both take their colour from a texture, so that light changes both in the same
    # way. With a material colour of 0.8, a lit texture keeps its own colour.
    for material in asset.findall("material[@name='screen']"):
        material.attrib |= {"texture": "tint", "rgba": "0.8 0.8 0.8 1"}
        _add(asset, "material", **(material.attrib | {"name": "face", "texture": "face"}))
    screen = next(part for part in parts(robot) if part.name == "screen")
    deep, half = screen.size[0], 0.45 * robot.shape.phone_width
    _geom(head, replace(screen, name="face", colour="face", size=(1.05 * deep, half, half)))


def _add(parent: ET.Element, tag: str, /, **attributes: object) -> ET.Element:
    texts = {
        name: _text(value) if isinstance(value, tuple) else str(value)
        for name, value in attributes.items()
    }
    return ET.SubElement(parent, tag, texts)


def _text(numbers: tuple[float, ...]) -> str:
    return " ".join(np.format_float_positional(number, trim="-") for number in numbers)
