"""MJCF and URDF agree with the kinematics and with the table of parts."""

from xml.etree import ElementTree

import numpy as np
import pytest
from numpy.testing import assert_allclose

from miburi.robot import JOINTS, Robot, buildable, forward, iphonoid
from miburi.robot.mjcf import to_mjcf
from miburi.robot.physics import mujoco
from miburi.robot.shape import parts
from miburi.robot.urdf import to_urdf

#: Tells MuJoCo to keep the shapes that are only drawn, and the fixed links.
KEEP = '<mujoco><compiler discardvisual="false" fusestatic="false"/></mujoco></robot>'


def test_the_urdf_has_places_limits_and_loads_of_the_description(robot: Robot) -> None:
    model = mujoco.MjModel.from_xml_string(to_urdf(robot).replace("</robot>", KEEP))
    ranges = [model.joint(name).range for name in JOINTS]
    assert_allclose(ranges, np.column_stack([robot.lower, robot.upper]), atol=1e-8)
    data = mujoco.MjData(model)
    for q in np.random.default_rng(4).uniform(robot.lower, robot.upper, (20, 8)):
        data.qpos[[model.joint(name).qposadr[0] for name in JOINTS]] = q
        mujoco.mj_kinematics(model, data)
        ends = np.concatenate([data.body(name).xpos for name in ("right", "left", "head_centre")])
        assert_allclose(ends, forward(robot, q), atol=1e-6)
    physical = mujoco.MjModel.from_xml_string(to_mjcf(robot))
    for body in range(physical.nbody):
        if physical.body(body).dofnum[0]:
            name = physical.body(body).name
            assert_allclose(model.body(name).mass, physical.body(name).mass, rtol=1e-6)
    whole = physical.body_subtreemass[physical.body("base_link").id]
    assert_allclose(model.body_subtreemass[0], whole, rtol=1e-6)


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
    drawn = mujoco.MjModel.from_xml_string(to_urdf(robot).replace("</robot>", KEEP))
    model = mujoco.MjModel.from_xml_string(to_mjcf(robot))
    for part in parts(robot):
        pieces = [i for i in range(drawn.ngeom) if drawn.geom(i).name.split(".")[0] == part.name]
        assert {drawn.body(drawn.geom_bodyid[i]).name for i in pieces} == {part.link}
        low, high = zip(*(corners(drawn, i) for i in pieces), strict=True)
        own = corners(model, model.geom(part.name).id)
        assert_allclose([np.min(low, 0), np.max(high, 0)], own, atol=1e-3, err_msg=part.name)


def test_each_link_of_the_urdf_has_a_mass(robot: Robot) -> None:
    """To PyBullet a link without weighs 1 kg."""
    root = ElementTree.fromstring(to_urdf(robot))
    masses = {link.get("name"): link.find("inertial/mass") for link in root.iter("link")}
    assert len(masses) == 12
    assert [name for name, mass in masses.items() if mass is None] == []


@pytest.mark.parametrize("body", [iphonoid(), buildable()], ids=lambda body: body.name)
def test_the_robot_stands_flat(body: Robot) -> None:
    """The stem was rounded to 2 and 4 mm below the foot, on which a free robot leaned."""
    for text in (to_mjcf(body), to_urdf(body).replace("</robot>", KEEP)):
        model = mujoco.MjModel.from_xml_string(text)
        of_the_base = [
            model.body(model.geom_bodyid[i]).name == "base_link" for i in range(model.ngeom)
        ]
        lows = [corners(model, i)[0][2] for i in np.flatnonzero(of_the_base)]
        assert_allclose(min(lows), -body.shape.pedestal_height, atol=1e-9)


@pytest.mark.parametrize("backlash", [0.0, 0.01])
def test_the_robot_alone_is_ready_for_other_programs(robot: Robot, backlash: float) -> None:
    servo = robot.servo.model
    loop = servo.loop.model_copy(update={"backlash": backlash})
    robot = robot.with_servo(servo.model_copy(update={"loop": loop}))
    model = mujoco.MjModel.from_xml_string(to_mjcf(robot, alone=True))
    scene = mujoco.MjModel.from_xml_string(to_mjcf(robot))
    whole = scene.body_subtreemass[scene.body("base_link").id]
    assert_allclose(model.body_subtreemass[0], whole, rtol=1e-9)
    assert (model.nlight, model.nmocap, model.body_geomnum[0]) == (0, 0, 0)
    joints = [model.joint(i).name for i in range(model.njnt)]
    motors = [model.actuator(i).name for i in range(model.nu)]
    assert motors == [name for name in joints if name in JOINTS]
    lower, upper, neutral = (
        dict(zip(JOINTS, values, strict=True))
        for values in (robot.lower, robot.upper, robot.neutral)
    )
    assert_allclose(model.actuator_ctrlrange, [(lower[name], upper[name]) for name in motors])
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("neutral").id)
    assert_allclose(data.ctrl, [neutral[name] for name in motors])
    assert_allclose(data.qpos, [neutral.get(name, 0.0) for name in joints])
    mujoco.mj_step(model, data, 500)
    angles = [data.joint(name).qpos[0] for name in JOINTS]
    assert_allclose(angles, robot.neutral, atol=0.03)  # it sags a little under its weight


def test_neutral_touches_nothing(robot: Robot) -> None:
    model = mujoco.MjModel.from_xml_string(to_mjcf(robot))
    data = mujoco.MjData(model)
    data.qpos[[model.joint(name).qposadr[0] for name in JOINTS]] = robot.neutral
    mujoco.mj_forward(model, data)
    assert data.ncon == 0
