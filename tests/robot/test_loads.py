"""Weight and inertia in closed form are those of the physical model."""

import numpy as np

from miburi.robot import JOINTS, Robot
from miburi.robot.loads import loads
from miburi.robot.mjcf import to_mjcf
from miburi.robot.physics import mujoco


def test_loads_are_the_physical_models(robot: Robot) -> None:
    model = mujoco.MjModel.from_xml_string(to_mjcf(robot))
    data = mujoco.MjData(model)
    places = [model.joint(name).qposadr[0] for name in JOINTS]
    dofs = [model.joint(name).dofadr[0] for name in JOINTS]
    mass = np.zeros((model.nv, model.nv))
    for angles in np.random.default_rng(3).uniform(robot.lower, robot.upper, (30, 8)):
        data.qpos[places] = angles
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, mass)
        found = loads(robot, angles)
        np.testing.assert_allclose(found.gravity, data.qfrc_bias[dofs], atol=1e-6)
        np.testing.assert_allclose(
            found.inertia, mass.diagonal()[dofs] - model.dof_armature[dofs], atol=1e-7
        )


def test_a_straight_arm_weighs_most_level(robot: Robot) -> None:
    level = robot.neutral.copy()
    level[[1, 2, 3]] = 0.0
    hanging = level.copy()
    hanging[2] = np.pi / 2
    assert abs(loads(robot, level).gravity[2]) > 0.02
    assert abs(loads(robot, hanging).gravity[2]) < 1e-12
    assert loads(robot, level).gravity[0] == 0.0  # the waist stands upright
