"""Real shapes in the models for simulators: drawn, and nothing else changes."""

from pathlib import Path

import numpy as np
from tests.fixtures.command import miburi

from miburi.robot.physics import mujoco


def test_a_model_with_real_shapes_weighs_and_collides_as_without(tmp_path: Path) -> None:
    robot = tmp_path / "robot.toml"
    robot.write_text(miburi("template", "robot", "buildable").stdout, encoding="utf-8")
    plain = miburi("export", "mjcf", "--robot", robot).stdout
    drawn = miburi("export", "mjcf", "--robot", robot, "--meshes", tmp_path / "shapes")
    assert drawn.returncode == 0, drawn.stderr
    one, two = (mujoco.MjModel.from_xml_string(text) for text in (plain, drawn.stdout))
    assert two.nmesh == len({*(tmp_path / "shapes").iterdir()}) == 16
    assert np.allclose(one.body_mass, two.body_mass)
    assert np.allclose(one.body_inertia, two.body_inertia)
    assert [(m.geom_contype > 0).sum() for m in (one, two)] == [(one.geom_contype > 0).sum()] * 2
    files = list((tmp_path / "shapes").iterdir())
    assert sum(file.stat().st_size for file in files) < 2e6


def test_urdf_names_the_shapes_files(tmp_path: Path) -> None:
    robot = tmp_path / "robot.toml"
    robot.write_text(miburi("template", "robot", "buildable").stdout, encoding="utf-8")
    said = miburi("export", "urdf", "--robot", robot, "--meshes", tmp_path / "shapes").stdout
    for file in (tmp_path / "shapes").iterdir():
        assert f'filename="{file}"' in said
    shapes = [line for line in said.splitlines() if "<mesh" in line]
    assert len(shapes) == len(list((tmp_path / "shapes").iterdir()))
    assert '<visual name="phone"' in said
