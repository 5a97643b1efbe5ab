"""Export the robot as URDF: in goes the description, out comes the text of a URDF file."""

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from miburi.robot.description import JOINTS, Robot
from miburi.robot.mjcf import to_mjcf
from miburi.robot.physics import mujoco
from miburi.robot.shape import BASE, COLOURS, Part, extremities, links, parts

__all__ = ["to_urdf"]


def to_urdf(robot: Robot, meshes: Mapping[tuple[str, str], str] | None = None) -> str:
    """Return the robot as URDF.

    ``meshes`` are files of the real shapes, in mm, by link and colour. With them, the real shapes
    and the phone are drawn; the shapes for collisions stay simple.

    Joints have the limits of Table 1 and the servo's speed and torque. Fixed links ``right``,
    ``left`` and ``head_centre`` mark the extremities. URDF has no capsules and no ellipsoids: a
    capsule becomes a cylinder with a sphere at each end, an ellipsoid the upright cylinder around
    it. Masses and inertias are those of the physical model.
    """
    root = ET.Element("robot", name=robot.name)
    for name, colour in COLOURS.items():
        ET.SubElement(ET.SubElement(root, "material", name=name), "color", rgba=_text(colour))
    model = mujoco.MjModel.from_xml_string(to_mjcf(robot))
    elements = {BASE: ET.SubElement(root, "link", name=BASE)}
    for link in links(robot):
        elements[link.name] = ET.SubElement(root, "link", name=link.name)
        joint = ET.SubElement(root, "joint", name=link.joint, type="revolute")
        ET.SubElement(joint, "origin", xyz=_text(link.position), rpy="0 0 0")
        ET.SubElement(joint, "parent", link=link.parent)
        ET.SubElement(joint, "child", link=link.name)
        ET.SubElement(joint, "axis", xyz=_text(link.axis))
        index = JOINTS.index(link.joint)
        stall_torque = robot.servo.model.data_sheet.stall_torque
        ET.SubElement(
            joint, "limit", lower=_text((robot.lower[index],)), upper=_text((robot.upper[index],)),
            velocity=_text((robot.servo.max_speed,)), effort=_text((stall_torque,)),
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
        visual = ET.SubElement(elements[name], "visual", name=f"{name}_{colour_name}")
        shape = ET.SubElement(visual, "geometry")
        ET.SubElement(shape, "mesh", filename=file, scale="0.001 0.001 0.001")
        ET.SubElement(visual, "material", name=colour_name)
    for name, (parent, point) in extremities(robot).items():
        child = "head_centre" if name == "head" else name
        ET.SubElement(root, "link", name=child)
        joint = ET.SubElement(root, "joint", name=f"{child}_mark", type="fixed")
        ET.SubElement(joint, "origin", xyz=_text(point), rpy="0 0 0")
        ET.SubElement(joint, "parent", link=parent)
        ET.SubElement(joint, "child", link=child)
    ET.indent(root)
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _inertial(link: ET.Element, model: mujoco.MjModel, name: str) -> None:
    body = model.body(name)
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, body.iquat)
    axes = turn.reshape(3, 3)
    tensor = axes @ np.diag(body.inertia) @ axes.T
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "origin", xyz=_text(body.ipos), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=_text((body.mass[0],)))
    names = {
        "ixx": (0, 0),
        "ixy": (0, 1),
        "ixz": (0, 2),
        "iyy": (1, 1),
        "iyz": (1, 2),
        "izz": (2, 2),
    }
    ET.SubElement(inertial, "inertia", {key: f"{tensor[at]:.9g}" for key, at in names.items()})


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
    element = ET.SubElement(link, use)
    start, turn = np.array(piece.position, dtype=np.float64), (0.0, -piece.tilt, 0.0)
    match piece.kind:
        case "cylinder":
            end = np.array(piece.end, dtype=np.float64)
            length = float(np.linalg.norm(end - start))
            x, y, z = (end - start) / length
            turn = (0.0, float(np.arctan2(np.hypot(x, y), z)), float(np.arctan2(y, x)))
            start = (start + end) / 2
            size = {"radius": _text(piece.size[:1]), "length": _text((length,))}
        case "box":
            size = {"size": _text(tuple(2 * half for half in piece.size))}
        case _:
            size = {"radius": _text(piece.size)}
    ET.SubElement(element, "origin", xyz=_text(start), rpy=_text(turn))
    ET.SubElement(ET.SubElement(element, "geometry"), piece.kind, size)
    if use == "visual":
        element.set("name", piece.name)
        ET.SubElement(element, "material", name=piece.colour)


def _text(numbers: tuple[float, ...] | np.ndarray) -> str:
    return " ".join(f"{float(number) + 0.0:.9g}" for number in numbers)  # no -0
