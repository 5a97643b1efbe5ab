"""A gesture that a hand showed: its key poses are those that were shown, and nothing else."""

from pathlib import Path

import numpy as np
import pytest

from miburi.errors import InputError
from miburi.gestures import key_poses, load, load_for
from miburi.gestures.coordinates import relative
from miburi.gestures.taught import as_toml, check_name, taught
from miburi.robot import JOINTS, Array, Robot, forward, load_robot

SHOULDER, ELBOW = JOINTS.index("right_shoulder"), JOINTS.index("right_elbow")


def shown(robot: Robot, *ways: tuple[float, float, float]) -> tuple[Array, Array]:
    """Move shoulder and elbow by ``ways``, (rad, rad, s) each, with 0.5 s of rest after each.

    At the end the hand lets go, and the body stands still for another 1.5 s.
    """
    rng, angles = np.random.default_rng(0), [robot.neutral]
    for shoulder, elbow, seconds in ways:
        there = angles[-1] + shoulder * np.eye(8)[SHOULDER] + elbow * np.eye(8)[ELBOW]
        steps = round(seconds / 0.02)
        angles += [angles[-1] + (there - angles[-1]) * k / steps for k in range(1, steps + 1)]
        angles += [there] * 25
    angles += [angles[-1]] * 75
    trembling = rng.uniform(-0.003, 0.003, (len(angles), 8))
    return 100 + 0.02 * np.arange(len(angles)), np.array(angles) + trembling


def kept(robot: Robot, tmp_path: Path, times: Array, angles: Array) -> Path:
    path = tmp_path / "wave.toml"
    path.write_text(as_toml(taught(robot, "wave", "happiness", times, angles)), "utf-8")
    return path


@pytest.mark.parametrize("body", ["paper", "tall"])
def test_it_goes_where_it_was_led(robot: Robot, tall_file: Path, tmp_path: Path, body: str) -> None:
    led = robot if body == "paper" else load_robot(tall_file)
    times, angles = shown(led, (1.0, 0.0, 1.2), (-0.4, -0.5, 0.8), (0.4, 0.5, 0.8))
    function = load_for(led, kept(led, tmp_path, times, angles))
    assert (function.name, function.feeling) == ("wave", "happiness")
    assert 3 <= len(function.pose) <= 8
    assert function.duration == pytest.approx(1.2 + 0.8 + 0.8 + 3 * 0.5 - 0.1 + 0.8, abs=0.25)
    places = [pose.target for pose in key_poses(led, function, 1.0)]
    for moment in (80, 145, 210):  # in the middle of each stay
        there = forward(led, angles[moment])
        assert min(np.abs(place - there).max() for place in places) < 0.025


def test_of_a_still_hand_nothing_is_kept(robot: Robot) -> None:
    with pytest.raises(InputError, match="no joint moved as far as 6°"):
        taught(robot, "wave", "happiness", *shown(robot, (0.05, 0.0, 0.5)))


def test_a_look_alone_can_be_shown(robot: Robot) -> None:
    times, angles = shown(robot, (0.0, 0.0, 2.0))
    head = JOINTS.index("head")
    angles[:, head] += 0.3 * np.clip((times - 100.5) / 0.5, 0, 1)
    (*_, last) = taught(robot, "nod", "surprise", times, angles).pose
    rises = [np.arctan2(to[2], np.hypot(*to[:2]))
             for to in (last.head, relative(robot, robot.neutral)[2])]  # fmt: skip
    assert abs(rises[0] - rises[1]) == pytest.approx(0.3, abs=0.02)


def test_nothing_at_all_is_refused(robot: Robot) -> None:
    with pytest.raises(InputError, match="no joint moved"):
        taught(robot, "wave", "happiness", np.empty(0), np.empty((0, 8)))


def test_what_takes_longer_than_a_gesture_may_is_refused(robot: Robot) -> None:
    with pytest.raises(InputError, match=r"at most 20 s, but this one took 2\d s"):
        taught(robot, "wave", "happiness", *shown(robot, (1.0, 0.0, 14.0), (-0.5, 0.0, 9.0)))


def test_a_long_demonstration_has_few_key_poses(robot: Robot) -> None:
    ways = [(0.8, 0.0, 0.5), *[(-0.4, -0.4, 0.3), (0.4, 0.4, 0.3)] * 8]
    times, angles = shown(robot, *ways)
    assert len(taught(robot, "wave", "happiness", times, angles).pose) <= 12


def test_a_stay_is_kept_and_the_wait_at_the_end_is_not(robot: Robot, tmp_path: Path) -> None:
    times, angles = shown(robot, (1.0, 0.0, 1.0))
    (*_, last) = load(str(kept(robot, tmp_path, times, angles))).pose
    assert last.until is not None
    function = taught(robot, "wave", "happiness", times, angles)
    assert (last.until - last.phase) * function.duration == pytest.approx(0.4, abs=0.1)


@pytest.mark.parametrize(
    ("name", "feeling", "words"),
    [("My Wave", "happiness", "a-z, 0-9 and _"), ("wave", "joy", "--feeling must be one of happ")],
)
def test_a_name_is_checked_before_anybody_leads(name: str, feeling: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        check_name(name, feeling)
