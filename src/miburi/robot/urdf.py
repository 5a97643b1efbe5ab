"""The robot as URDF, made from the description, for tools that read that."""

import xml.etree.ElementTree as ET

import numpy as np

from miburi.physics import mujoco
from miburi.robot.description import JOINTS, Robot
from miburi.robot.mjcf import to_mjcf
from miburi.robot.shape import COLOURS, Part, extremities, links, parts


def to_urdf(robot: Robot) -> str:
    """Return the robot as URDF.

    Joints carry the limits of Table 1, the servo's speed and torque. Fixed links ``right``,
    ``left`` and ``head_centre`` mark the extremities. URDF knows no capsules: they become
    cylinders. Masses and inertias are those of the physical model.
    """
    root = ET.Element("robot", name=robot.name)
    for name, colour in COLOURS.items():
        ET.SubElement(ET.SubElement(root, "material", name=name), "color", rgba=_text(colour))
    model = mujoco.MjModel.from_xml_string(to_mjcf(robot))
    made = {"base": ET.SubElement(root, "link", name="base")}
    for link in links(robot):
        made[link.name] = ET.SubElement(root, "link", name=link.name)
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
    for name, link_element in made.items():
        _inertial(link_element, model, name)
    for part in parts(robot):
        for use in ("visual", "collision") if part.mass else ("visual",):
            _shape(ET.SubElement(made[part.link], use), part, use)
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


def _shape(element: ET.Element, part: Part, use: str) -> None:
    start, turn = np.array(part.position, dtype=np.float64), (0.0, -part.tilt, 0.0)
    geometry = ET.SubElement(element, "geometry")
    if part.end is not None:
        end = np.array(part.end, dtype=np.float64)
        length = float(np.linalg.norm(end - start))
        x, y, z = (end - start) / length
        turn = (0.0, float(np.arctan2(np.hypot(x, y), z)), float(np.arctan2(y, x)))
        start = (start + end) / 2
        ET.SubElement(geometry, "cylinder", radius=_text(part.size), length=_text((length,)))
    elif part.kind == "box":
        ET.SubElement(geometry, "box", size=_text(tuple(2 * half for half in part.size)))
    else:
        ET.SubElement(geometry, "sphere", radius=_text(part.size[:1]))
    element.insert(0, ET.Element("origin", xyz=_text(start), rpy=_text(turn)))
    if use == "visual":
        ET.SubElement(element, "material", name=part.colour)


def _text(numbers: tuple[float, ...] | np.ndarray) -> str:
    return " ".join(f"{float(number):.9g}" for number in numbers)
