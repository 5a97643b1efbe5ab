"""The models made from the description: MJCF and URDF say the same as the kinematics."""

import xml.etree.ElementTree as ET

import ikpy.chain
import numpy as np
import pytest
from numpy.testing import assert_allclose

from miburi.physics import mujoco
from miburi.robot import JOINTS, Robot, forward
from miburi.robot.mjcf import to_mjcf
from miburi.robot.urdf import to_urdf

CHAINS = {
    0: ["right_shoulder", "right_upper_arm", "right_forearm", "right"],
    3: ["left_shoulder", "left_upper_arm", "left_forearm", "left"],
    6: ["head", "head_centre"],
}


@pytest.mark.filterwarnings("ignore:Link .* is of type 'fixed'")
def test_the_urdf_puts_hands_and_head_where_we_do(robot: Robot, tmp_path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(to_urdf(robot))
    joints = {joint.find("child").get("link"): joint for joint in ET.parse(path).iter("joint")}
    for first, names in CHAINS.items():
        elements = ["base"]
        for link in ["torso", *names]:
            elements += [joints[link].get("name"), link]
        chain = ikpy.chain.Chain.from_urdf_file(str(path), base_elements=elements)
        order = [JOINTS.index(link.name) for link in chain.links[1:-1]]
        for q in np.random.default_rng(4).uniform(robot.lower, robot.upper, (50, 8)):
            found = chain.forward_kinematics([0, *q[order], 0])[:3, 3]
            assert_allclose(found, forward(robot, q)[first : first + 3], atol=1e-6)


def test_the_urdf_carries_limits_and_loads_in_mujoco(robot: Robot) -> None:
    model = mujoco.MjModel.from_xml_string(to_urdf(robot))
    ranges = [model.joint(name).range for name in JOINTS]
    assert_allclose(ranges, np.column_stack([robot.lower, robot.upper]), atol=1e-8)
    physical = mujoco.MjModel.from_xml_string(to_mjcf(robot))
    moving = [physical.body(i).name for i in range(physical.nbody) if physical.body(i).dofnum[0]]
    for name in moving:
        assert_allclose(model.body(name).mass, physical.body(name).mass, rtol=1e-6)


def test_neutral_touches_nothing(robot: Robot) -> None:
    model = mujoco.MjModel.from_xml_string(to_mjcf(robot))
    data = mujoco.MjData(model)
    data.qpos[[model.joint(name).qposadr[0] for name in JOINTS]] = robot.neutral
    mujoco.mj_forward(model, data)
    assert data.ncon == 0
