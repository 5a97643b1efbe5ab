"""The gestures of a partner: the shipped ones, and those with which a user replaces them."""

from pathlib import Path

import numpy as np
import pytest

from miburi.errors import DescriptionError, InputError
from miburi.feelings import FEELINGS
from miburi.gestures import Repertoire, load, misfits, read_repertoire, shipped_repertoire
from miburi.robot import Robot, load_robot


def names(repertoire: Repertoire) -> list[str]:
    return [function.name for function in repertoire.functions]


def test_every_feeling_has_a_shipped_gesture_that_the_iphonoid_can_do(robot: Robot) -> None:
    assert names(shipped_repertoire()) == list(FEELINGS)
    assert [list(misfits(robot, function)) for function in shipped_repertoire().functions] == [
        []
    ] * 8


def test_own_gestures_replace_those_of_their_feeling(robot: Robot, own_gestures: Path) -> None:
    own = read_repertoire(own_gestures, robot)
    assert names(own) == ["cheer", *FEELINGS[1:]]
    assert own.of("happiness") == (load(own_gestures / "cheer.toml"),)


def test_choosing_from_a_single_gesture_draws_no_random_number() -> None:
    """So a seed gives the same run as before there was a choice."""
    used, fresh = np.random.default_rng(5), np.random.default_rng(5)
    shipped_repertoire().choose("anger", used)
    assert used.random() == fresh.random()


def test_the_error_for_a_gesture_that_does_not_fit_names_file_and_pose(
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
        Repertoire(shipped_repertoire().functions[:-1])
