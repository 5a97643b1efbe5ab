"""Export the robot as URDF: from its description, make the text of a URDF file."""

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from miburi.robot.description import JOINTS, Robot
from miburi.robot.mjcf import to_mjcf
from miburi.robot.physics import mujoco
from miburi.robot.shape import BASE, COLOURS, Part, fixed_frames, links, parts

#: The mass of the fixed links in kg; to some programs, a link without a mass weighs 1 kg.
_NEXT_TO_NOTHING = 1e-9


def to_urdf(robot: Robot, meshes: Mapping[tuple[str, str], str] | None = None) -> str:
    """Return the robot as URDF.

    ``meshes`` are the files of the real shapes (in mm) by link and colour. If they are given, the
    real shapes and the phone are drawn; the shapes for collisions stay simple.

    Joints have the limits of Table 1 and the servo's speed and torque. Fixed links ``right``,
    ``left`` and ``head_centre`` mark the extremities. URDF has no capsules and no ellipsoids: a
    capsule becomes a cylinder with a sphere at each end, an ellipsoid becomes the upright cylinder
    around it. Masses and inertias are those of the physical model.
    """
    root = ET.Element("robot", name=robot.name)
    for name, colour in COLOURS.items():
        _add(_add(root, "material", name=name), "color", rgba=colour)
    model = mujoco.MjModel.from_xml_string(to_mjcf(robot))
    elements = {BASE: _add(root, "link", name=BASE)}
    effort = robot.servo.model.data_sheet.stall_torque
    for link in links(robot):
        elements[link.name] = _add(root, "link", name=link.name)
        joint = _add(root, "joint", name=link.joint, type="revolute")
        _add(joint, "origin", xyz=link.position, rpy="0 0 0")
        _add(joint, "parent", link=link.parent)
        _add(joint, "child", link=link.name)
        _add(joint, "axis", xyz=link.axis)
        index = JOINTS.index(link.joint)
        _add(
            joint, "limit", lower=robot.lower[index], upper=robot.upper[index],
            velocity=robot.servo.max_speed, effort=effort,
        )  # fmt: skip
    for name, link_element in elements.items():
        _inertial(link_element, model, name)
    for part in parts(robot):
        for piece in _pieces(part):
            if meshes is None or part.of_the_phone:
                _shape(elements[part.link], "visual", piece)
            if part.mass:
                _shape(elements[part.link], "collision", piece)
    for (name, colour_name), file in (meshes or {}).items():
        visual = _add(elements[name], "visual", name=f"{name}_{colour_name}")
        _add(_add(visual, "geometry"), "mesh", filename=file, scale="0.001 0.001 0.001")
        _add(visual, "material", name=colour_name)
    for frame in fixed_frames(robot):
        inertial = _add(_add(root, "link", name=frame.child), "inertial")
        _add(inertial, "mass", value=_NEXT_TO_NOTHING)
        spread = _NEXT_TO_NOTHING * 1e-4  # as of a ball with a radius of 16 mm
        _add(inertial, "inertia", ixx=spread, ixy=0, ixz=0, iyy=spread, iyz=0, izz=spread)
        joint = _add(root, "joint", name=f"{frame.child}_mark", type="fixed")
        _add(joint, "origin", xyz=frame.position, rpy="0 0 0")
        _add(joint, "parent", link=frame.parent)
        _add(joint, "child", link=frame.child)
    ET.indent(root)
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _inertial(link: ET.Element, model: mujoco.MjModel, name: str) -> None:
    body = model.body(name)
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, body.iquat)
    axes = turn.reshape(3, 3)
    tensor = axes @ np.diag(body.inertia) @ axes.T
    inertial = _add(link, "inertial")
    _add(inertial, "origin", xyz=body.ipos, rpy="0 0 0")
    _add(inertial, "mass", value=body.mass[0])
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = tensor
    _add(inertial, "inertia", ixx=xx, ixy=xy, ixz=xz, iyy=yy, iyz=yz, izz=zz)


def _pieces(part: Part) -> list[Part]:
    """Split a solid into shapes that URDF has, each with its own name."""
    match part.kind:
        case "capsule":
            ends = {"start": part.position, "end": part.end or part.position}
            balls = [
                replace(part, name=f"{part.name}.{end}", kind="sphere", position=place, end=None)
                for end, place in ends.items()
            ]
            return [replace(part, kind="cylinder"), *balls]
        case "ellipsoid":
            (x, y, z), half = part.position, part.size[2]
            return [replace(part, kind="cylinder", position=(x, y, z - half), end=(x, y, z + half))]
    return [part]


def _shape(link: ET.Element, use: str, piece: Part) -> None:
    """Add a sphere, a box or a cylinder as ``visual`` or ``collision``, according to ``use``."""
    element = _add(link, use)
    start, turn = np.array(piece.position, dtype=np.float64), (0.0, -piece.tilt, 0.0)
    match piece.kind:
        case "cylinder":
            end = np.array(piece.end, dtype=np.float64)
            length = float(np.linalg.norm(end - start))
            x, y, z = (end - start) / length
            turn = (0.0, float(np.arctan2(np.hypot(x, y), z)), float(np.arctan2(y, x)))
            start = (start + end) / 2
            size: dict[str, object] = {"radius": piece.size[0], "length": length}
        case "box":
            size = {"size": [2 * half for half in piece.size]}
        case _:
            size = {"radius": piece.size}
    _add(element, "origin", xyz=start, rpy=turn)
    _add(_add(element, "geometry"), piece.kind, **size)
    if use == "visual":
        element.set("name", piece.name)
        _add(element, "material", name=piece.colour)


def _add(parent: ET.Element, tag: str, /, **attributes: Any) -> ET.Element:
    texts = {
        name: value
        if isinstance(value, str)
        else " ".join(f"{number + 0.0:.9g}" for number in np.atleast_1d(value))  # no -0
        for name, value in attributes.items()
    }
    return ET.SubElement(parent, tag, texts)
