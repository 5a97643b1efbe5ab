"""Real shapes in the models for simulators: drawn, and nothing else changes."""

from pathlib import Path

import numpy as np
import pytest
from tests.fixtures.command import miburi

from miburi.robot import buildable
from miburi.robot.mjcf import to_mjcf
from miburi.robot.physics import mujoco
from miburi.robot.urdf import to_urdf


def test_a_model_with_real_shapes_weighs_and_collides_as_without(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And it may be moved together with the folder of its shapes."""
    there, here = tmp_path / "there", tmp_path / "here"
    there.mkdir()
    monkeypatch.chdir(there)
    Path("robot.toml").write_text(miburi("template", "robot", "buildable").stdout, encoding="utf-8")
    drawn = miburi("export", "mjcf", "--robot", "robot.toml", "--meshes", "shapes")
    assert drawn.returncode == 0, drawn.stderr
    Path("robot.xml").write_text(drawn.stdout, encoding="utf-8")
    there.rename(here)
    files = list((here / "shapes").iterdir())
    assert sum(file.stat().st_size for file in files) < 2e6
    one = mujoco.MjModel.from_xml_string(to_mjcf(buildable(), alone=True))
    two = mujoco.MjModel.from_xml_path(str(here / "robot.xml"))
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
