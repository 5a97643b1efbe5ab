"""MJCF and URDF agree with the kinematics and with the table of parts."""

import xml.etree.ElementTree as ET

import ikpy.chain
import numpy as np
import pytest
from numpy.testing import assert_allclose

from miburi.robot import JOINTS, Robot, forward
from miburi.robot.mjcf import to_mjcf
from miburi.robot.physics import mujoco
from miburi.robot.shape import parts
from miburi.robot.urdf import to_urdf

CHAINS = {
    0: ["right_shoulder", "right_upper_arm", "right_forearm", "right"],
    3: ["left_shoulder", "left_upper_arm", "left_forearm", "left"],
    6: ["head", "head_centre"],
}


@pytest.mark.filterwarnings("ignore:Link .* is of type 'fixed'")
def test_the_urdf_puts_hands_and_head_where_the_kinematics_does(robot: Robot, tmp_path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(to_urdf(robot))
    joints = {joint.find("child").get("link"): joint for joint in ET.parse(path).iter("joint")}
    for first, names in CHAINS.items():
        elements = ["base_link"]
        for link in ["torso", *names]:
            elements += [joints[link].get("name"), link]
        chain = ikpy.chain.Chain.from_urdf_file(str(path), base_elements=elements)
        order = [JOINTS.index(link.name) for link in chain.links[1:-1]]
        for q in np.random.default_rng(4).uniform(robot.lower, robot.upper, (50, 8)):
            positions = chain.forward_kinematics([0, *q[order], 0])[:3, 3]
            assert_allclose(positions, forward(robot, q)[first : first + 3], atol=1e-6)


def test_the_urdf_carries_limits_and_loads_in_mujoco(robot: Robot) -> None:
    model = mujoco.MjModel.from_xml_string(to_urdf(robot))
    ranges = [model.joint(name).range for name in JOINTS]
    assert_allclose(ranges, np.column_stack([robot.lower, robot.upper]), atol=1e-8)
    physical = mujoco.MjModel.from_xml_string(to_mjcf(robot))
    moving = [physical.body(i).name for i in range(physical.nbody) if physical.body(i).dofnum[0]]
    for name in moving:
        assert_allclose(model.body(name).mass, physical.body(name).mass, rtol=1e-6)
    masses = [float(mass.get("value")) for mass in ET.fromstring(to_urdf(robot)).iter("mass")]
    whole = physical.body_subtreemass[physical.body("base_link").id]
    assert_allclose(sum(masses), whole, rtol=1e-6)


def corners(model: mujoco.MjModel, geom: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the least and the greatest x, y, z of a solid in the frame of its link."""
    turn, size = np.zeros(9), model.geom_size[geom]
    mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
    axes = turn.reshape(3, 3)
    match mujoco.mjtGeom(model.geom_type[geom]):
        case mujoco.mjtGeom.mjGEOM_SPHERE:
            half = np.full(3, size[0])
        case mujoco.mjtGeom.mjGEOM_ELLIPSOID:
            half = np.linalg.norm(axes * size, axis=1)
        case mujoco.mjtGeom.mjGEOM_BOX:
            half = np.abs(axes) @ size
        case mujoco.mjtGeom.mjGEOM_CAPSULE:
            half = size[0] + size[1] * np.abs(axes[:, 2])
        case mujoco.mjtGeom.mjGEOM_CYLINDER:
            across = np.sqrt(np.maximum(0.0, 1.0 - axes[:, 2] ** 2))
            half = size[0] * across + size[1] * np.abs(axes[:, 2])
        case other:
            raise AssertionError(f"The models have no such solid: {other}.")
    return model.geom_pos[geom] - half, model.geom_pos[geom] + half


def test_the_urdf_draws_every_part_in_its_place_and_size(robot: Robot) -> None:
    keep = '<mujoco><compiler discardvisual="false" fusestatic="false"/></mujoco>'
    drawn = mujoco.MjModel.from_xml_string(to_urdf(robot).replace("</robot>", f"{keep}</robot>"))
    model = mujoco.MjModel.from_xml_string(to_mjcf(robot))
    for part in parts(robot):
        pieces = [i for i in range(drawn.ngeom) if drawn.geom(i).name.split(".")[0] == part.name]
        assert {drawn.body(drawn.geom_bodyid[i]).name for i in pieces} == {part.link}
        low, high = zip(*(corners(drawn, i) for i in pieces), strict=True)
        own = corners(model, model.geom(part.name).id)
        assert_allclose([np.min(low, 0), np.max(high, 0)], own, atol=1e-3, err_msg=part.name)


def test_neutral_touches_nothing(robot: Robot) -> None:
    model = mujoco.MjModel.from_xml_string(to_mjcf(robot))
    data = mujoco.MjData(model)
    data.qpos[[model.joint(name).qposadr[0] for name in JOINTS]] = robot.neutral
    mujoco.mj_forward(model, data)
    assert data.ncon == 0
