"""A partner's gestures: the shipped ones, and a user's in their place."""

from pathlib import Path

import numpy as np
import pytest

from miburi.errors import DescriptionError, InputError
from miburi.feelings import FEELINGS
from miburi.gestures import Repertoire, load, misfits, read_repertoire, shipped
from miburi.robot import Robot, load_robot


def names(repertoire: Repertoire) -> list[str]:
    return [function.name for function in repertoire.functions]


def test_every_feeling_has_a_shipped_gesture_that_the_iphonoid_can_do(robot: Robot) -> None:
    assert names(shipped()) == list(FEELINGS)
    assert [list(misfits(robot, function)) for function in shipped().functions] == [[]] * 8


def test_own_gestures_replace_those_of_their_feeling(robot: Robot, own_gestures: Path) -> None:
    own = read_repertoire(own_gestures, robot)
    assert names(own) == ["cheer", *FEELINGS[1:]]
    assert own.of("happiness") == (load(own_gestures / "cheer.toml"),)


def test_several_gestures_of_one_feeling_stand_side_by_side(
    robot: Robot, own_gestures: Path, tmp_path: Path
) -> None:
    for name in ("cheer", "wave"):
        text = (own_gestures / "cheer.toml").read_text().replace("cheer", name)
        (tmp_path / f"{name}.toml").write_text(text)
    own = read_repertoire(tmp_path, robot)
    assert [function.name for function in own.of("happiness")] == ["cheer", "wave"]
    rng = np.random.default_rng(0)
    assert {own.choose("happiness", rng).name for _ in range(20)} == {"cheer", "wave"}


def test_choosing_from_one_draws_nothing() -> None:
    """So a seed means the same with and without the possibility to choose."""
    used, fresh = np.random.default_rng(5), np.random.default_rng(5)
    shipped().choose("anger", used)
    assert used.random() == fresh.random()


def test_a_gesture_that_does_not_fit_is_refused_by_file_and_pose(
    robot: Robot, tall_file: Path, unfit_gestures: Path
) -> None:
    file = unfit_gestures / "hooray.toml"
    tall = load_robot(tall_file)
    with pytest.raises(DescriptionError, match=rf"{file}: pose 1: right = .*; allowed is what"):
        read_repertoire(unfit_gestures, tall)
    assert "hooray" in names(read_repertoire(unfit_gestures, robot))


def test_shipped_gestures_that_do_not_fit_are_kept(tall_file: Path, own_gestures: Path) -> None:
    tall = load_robot(tall_file)
    own = read_repertoire(own_gestures, tall)
    assert [f.name for f in own.functions if not any(misfits(tall, f))] == [
        "cheer", "sadness", "surprise",
    ]  # fmt: skip


def test_wrong_folders_are_refused(robot: Robot, own_gestures: Path, tmp_path: Path) -> None:
    with pytest.raises(DescriptionError, match="no gesture file"):
        read_repertoire(tmp_path, robot)
    with pytest.raises(DescriptionError, match="no gesture file"):
        read_repertoire(tmp_path / "nowhere", robot)
    for name in ("one", "two"):
        (tmp_path / f"{name}.toml").write_text((own_gestures / "cheer.toml").read_text())
    with pytest.raises(InputError, match="2 gestures have the name 'cheer'"):
        read_repertoire(tmp_path, robot)


def test_a_feeling_without_a_gesture_is_refused() -> None:
    with pytest.raises(InputError, match="no gesture for surprise"):
        Repertoire(shipped().functions[:-1])
