"""Real shapes in the models for simulators: drawn, and nothing else changes."""

from pathlib import Path

import numpy as np
from tests.fixtures.command import miburi

from miburi.robot import buildable
from miburi.robot.mjcf import to_mjcf
from miburi.robot.physics import mujoco
from miburi.robot.urdf import to_urdf


def test_a_model_with_real_shapes_weighs_and_collides_as_without(tmp_path: Path) -> None:
    robot, folder = tmp_path / "robot.toml", tmp_path / "shapes"
    robot.write_text(miburi("template", "robot", "buildable").stdout, encoding="utf-8")
    drawn = miburi("export", "mjcf", "--robot", robot, "--meshes", folder)
    assert drawn.returncode == 0, drawn.stderr
    files = list(folder.iterdir())
    assert sum(file.stat().st_size for file in files) < 2e6
    one, two = map(mujoco.MjModel.from_xml_string, (to_mjcf(buildable(), alone=True), drawn.stdout))
    assert two.nmesh == len(files) == 16
    assert np.allclose(one.body_mass, two.body_mass)
    assert np.allclose(one.body_inertia, two.body_inertia)
    assert (one.geom_contype > 0).sum() == (two.geom_contype > 0).sum()


def test_urdf_names_the_shapes_files_and_draws_the_phone() -> None:
    urdf = to_urdf(buildable(), {("torso", "cream"): "torso.stl", ("head", "coral"): "head.stl"})
    assert [line.count(".stl") for line in urdf.splitlines() if "<mesh" in line] == [1, 1]
    assert 'filename="torso.stl"' in urdf
    assert '<visual name="phone"' in urdf
    assert '<visual name="trunk"' not in urdf
