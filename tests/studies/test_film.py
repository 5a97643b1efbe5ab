"""Pictures show the robot, the hand and the words; films are films."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from miburi.errors import OutputError
from miburi.robot import Robot, buildable
from miburi.studies import film
from miburi.studies.film import Scene, camera, contact_sheet, write_film


def test_pictures_show_pose_hand_and_caption(robot: Robot) -> None:
    raised = robot.neutral + np.array([0, 1.5, 0, 0, 1.5, 0, 0, 0])
    hand = np.array([0.15, -0.1, 0.1, 1.0, 0, 0, 0])
    scenes = [
        Scene(robot.neutral),
        Scene(raised),
        Scene(robot.neutral, hand),
        Scene(robot.neutral, caption="mood 0.9"),
    ]
    with camera(robot, 160, 120) as opened:
        plain, *others = [opened.picture(scene) for scene in scenes]
        assert plain.shape == (120, 160, 3)
        assert plain.std() > 10
        for other in others:
            assert np.abs(other.astype(int) - plain).max() > 50
        assert np.array_equal(opened.picture(scenes[0]), plain)


@pytest.mark.proof("test_pictures_show_pose_hand_and_caption")
def test_a_robot_that_can_be_built_is_filmed_as_printed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Servos are seen; without the extra the description's solids are drawn, which have none."""
    body = buildable()
    dark = []
    for kernel in (True, False):
        if not kernel:
            monkeypatch.setattr(film, "shapes_if_it_can_be_built", lambda _: {})
        with camera(body, 320, 240) as opened:
            picture = opened.picture(Scene(np.array(body.neutral)))
        dark.append(int((picture[100:].max(axis=2) < 60).sum()))  # below the phone
    assert dark[0] > 20 * max(1, dark[1])


def test_a_film_is_written(robot: Robot, tmp_path: Path) -> None:
    done: list[int] = []
    scenes = [Scene(robot.neutral + 0.01 * k) for k in range(5)]
    path = write_film(robot, scenes, tmp_path / "x", size=(64, 48), progress=done.append)
    if shutil.which("ffmpeg"):
        assert path.suffix == ".mp4"
        assert path.read_bytes()[4:8] == b"ftyp"
        assert done == [1, 2, 3, 4, 5]
    else:
        assert path.name == "x.sheet.png"


def test_without_ffmpeg_a_sheet_takes_its_place(
    robot: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(film.shutil, "which", lambda _: None)
    path = write_film(robot, [Scene(robot.neutral)] * 3, tmp_path / "x", size=(64, 48))
    assert path == tmp_path / "x.sheet.png"
    with Image.open(path) as sheet:
        assert sheet.size == (4 * 64, 3 * 48)


def test_where_nothing_can_be_drawn_the_packages_are_named(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise ImportError("no EGL")

    monkeypatch.setattr(film.mujoco, "Renderer", fail)
    with pytest.raises(OutputError, match="no EGL.*libegl1"), camera(robot):
        pass


def test_a_contact_sheet_fills_its_rows() -> None:
    pictures = [np.full((2, 3, 3), k, dtype=np.uint8) for k in range(5)]
    sheet = contact_sheet(pictures, 2)
    assert sheet.shape == (6, 6, 3)
    assert (sheet[4:, 3:] == 255).all()
