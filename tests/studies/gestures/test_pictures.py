import numpy as np
import pytest
from PIL import Image

from miburi.bodies.rehearsal import rehearse
from miburi.gestures import key_poses, load
from miburi.studies.gestures import pictures


@pytest.fixture(scope="module")
def surprise(robot):
    return rehearse(robot, key_poses(robot, load("surprise"), 0.9))


@pytest.fixture(scope="module")
def strip(robot, surprise):
    with pictures.camera_on(robot) as camera:
        return pictures.strip(camera, surprise)


def moments_of(strip):
    rows = np.split(strip.astype(int), 2)
    return [moment for row in rows for moment in np.split(row, 6, axis=1)]


@pytest.mark.proof("test_paths_are_drawn")
def test_a_strip_shows_twelve_moments_and_the_whole_robot(strip):
    height, width, _ = strip.shape
    assert width == 3 * height
    moments = moments_of(strip)
    assert all(np.abs(one - moments[0]).max() > 50 for one in moments[1:6])
    height //= 2
    # Nothing of the robot is cut off: above and beside it there is only the plain wall.
    for moment in moments:
        for edge in (moment[:8], moment[: height // 2, :8], moment[: height // 2, -8:]):
            assert np.ptp(edge, axis=1).max() <= 12  # a row of wall has one colour


@pytest.mark.proof("test_paths_are_drawn")
def test_a_moment_has_a_trail_only_where_something_moves(strip):
    moments = moments_of(strip)
    assert np.abs(moments[2] - moments[3]).mean() < np.abs(moments[0] - moments[1]).mean() / 2


def test_paths_are_drawn(robot, surprise, tmp_path):
    file = pictures.paths(robot, surprise, tmp_path / "paths.png")
    pixels = np.array(Image.open(file).convert("RGB")).reshape(-1, 3).astype(int)
    assert (np.abs(pixels - [217, 85, 63]).sum(axis=1) < 20).sum() > 50  # the right hand's colour


def test_showing_a_gesture_writes_what_it_names(robot, tmp_path, monkeypatch):
    monkeypatch.setattr(pictures, "write_film", lambda _, scenes, path, **size: path)
    monkeypatch.setattr(pictures, "strip", lambda *_: np.zeros((2, 12, 3), np.uint8))
    shown = pictures.show(robot, load("surprise"), 0.3, tmp_path, None)
    assert (shown.strip, shown.paths) == ("surprise-0.3-strip.png", "surprise-0.3-paths.png")
    assert shown.film == "surprise-0.3.mp4"
    assert {file.name for file in tmp_path.iterdir()} == {shown.strip, shown.paths}
    assert shown.mood == 0.3
