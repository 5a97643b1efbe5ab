"""Gesture files: the eight load, and the errors for wrong files help."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from miburi.errors import DescriptionError, InputError
from miburi.feelings import FEELINGS
from miburi.gestures import load, load_for
from miburi.gestures.coordinates import neutral, polar, targets
from miburi.gestures.movement import Posture
from miburi.robot import forward, iphonoid

GOOD = """
name = "wave"
feeling = "happiness"
duration = 2.0

[effort]
space = 1.0
weight = 0.2
time = 0.5
flow = 0.8

[[pose]]
phase = 0.4
right = [0.3, 0.6, 0.7]
left = [0.1, 0.13, -0.97]
head = [0.7, 0.0, 0.72]

[[pose]]
phase = 0.6
right = [0.3, 0.7, 0.6]
left = [0.1, 0.13, -0.97]
head = [0.7, 0.0, 0.72]

[repeat]
first = 1
last = 2
times = 2
back = 0.1
"""


@pytest.fixture
def file(tmp_path: Path):
    def write(old: str = "", new: str = "") -> Path:
        assert old in GOOD
        path = tmp_path / "wave.toml"
        path.write_text(GOOD.replace(old, new, 1))
        return path

    return write


def test_every_feeling_has_a_gesture():
    for feeling in FEELINGS:
        assert load(feeling).feeling == load(feeling).name == feeling


def test_a_user_adds_a_gesture_without_touching_code(file):
    assert load(file()).name == "wave"
    assert load(str(file())) == load(file())


def test_if_every_pose_is_wrong_only_their_own_faults_are_told(tmp_path):
    first = GOOD.index("[[pose]]", GOOD.index("[[pose]]") + 1)
    (tmp_path / "far.toml").write_text(GOOD[:first].replace("0.3, 0.6, 0.7", "1.9, 0.6, 0.7"))
    with pytest.raises(DescriptionError, match=r"right\.0 = 1\.9: input should be [^:]* to 1\.$"):
        load(tmp_path / "far.toml")


def test_the_error_for_an_unknown_feeling_lists_the_feelings():
    with pytest.raises(InputError, match=r"no gesture for 'joy'.*happiness"):
        load("joy")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            'feeling = "happiness"',
            'feeling = "joy"',
            r"feeling = 'joy'.*the known ones are happiness, sad",
        ),
        ("phase = 0.6", "phase = 0.3", r"pose 2 has the phase 0\.3; it must come after 0\.4"),
        ("phase = 0.6", "phase = 1.0", r"leaves the last pose at 1\.0; it must leave before 1"),
        ("phase = 0.4", "phase = 0.4\nuntil = 0.2", r"until must not be before phase \(0\.4\)"),
        (
            "[0.3, 0.6, 0.7]",
            "[0.3, 0.9, 0.7]",
            r"1\.179 times the arm's reach.*at most 1 is allowed",
        ),
        ("[0.3, 0.6, 0.7]", "[0.3, 0.6]", r"right = \[0\.3, 0\.6\].*at least 3"),
        ("[0.3, 0.6, 0.7]", "[-0.9, 0.1, 0.0]", r"pose 1: right = .*out of reach; allowed"),
        ("[0.3, 0.6, 0.7]", "[0.1, 0.1, 0.1]", r"pose 1: right = .*at a distance of 0\.65 to 1"),
        ("left = [0.1, 0.13, -0.97]", "left = [-0.9, 0.0, 0.1]", r"pose 1: left = .*out of rea"),
        (
            "head = [0.7, 0.0, 0.72]",
            "head = [0.0, 0.0, 1.0]",
            r"head = .*points straight up or " r"nowhere",
        ),
        ("head = [0.7, 0.0, 0.72]", "head = [0.9, 0.0, -0.4]", r"raises the head by -0\.418 rad"),
        ("head = [0.7, 0.0, 0.72]", "head = [-0.7, 0.0, 0.7]", r"turns the waist by 3\.142"),
        ("first = 1", "first = 2", r"repeat goes from pose 2 to 2; it must go"),
        ("last = 2", "last = 3", r"repeat goes from pose 1 to 3; it must go .* of 2"),
        ("space = 1.0", "space = 1.5", r"effort\.space = 1\.5.*less than or equal to 1"),
        ("duration = 2.0", 'duration = 2.0\nhedge = "rather"', r"hedge = 'rather'.*'very'"),
    ],
)
def test_the_error_for_a_wrong_file_names_file_key_value_and_range(robot, file, old, new, words):
    path = file(old, new)
    with pytest.raises(DescriptionError, match=rf"(?s){path}: .*{words}"):
        load_for(robot, path)


def test_hands_are_where_the_file_says_in_the_frame_of_the_turned_chest(robot):
    pose = Posture(phase=0.5, right=[0.3, 0.6, 0.7], left=[0.9, 0.2, 0.1], head=[0.5, 0.5, 0.7])
    reach = robot.lengths.L23 + robot.lengths.L34
    shoulder = np.array([0, robot.lengths.L12, robot.lengths.L01])
    places = targets(robot, pose.coordinates).reshape(3, 3)
    assert np.arctan2(places[2, 1], places[2, 0]) == pytest.approx(np.pi / 4)
    quarter = np.sqrt(0.5)
    ahead, left = np.array([quarter, quarter, 0]), np.array([-quarter, quarter, 0])
    right_hand, left_hand = (
        np.array([place @ ahead, place @ left, place[2]]) for place in places[:2]
    )
    assert right_hand == pytest.approx((shoulder + reach * np.array(pose.right)) * [1, -1, 1])
    assert left_hand == pytest.approx(shoulder + reach * np.array(pose.left))


def test_neutral_is_where_its_coordinates_say(robot):
    assert targets(robot, neutral(robot)) == pytest.approx(forward(robot, robot.neutral), abs=1e-15)


@given(
    st.lists(st.tuples(st.floats(0.1, 1), st.floats(0.01, 3), st.floats(-1.5, 4.6)),
             min_size=2, max_size=2),
    st.floats(-3, 3), st.floats(-1.5, 1.5),
)  # fmt: skip
def test_coordinates_say_where_and_where_says_the_coordinates(hands, turn, rise):
    """There and back, for every place that a hand can be in."""
    wanted = np.array([*hands[0], *hands[1], turn, rise])
    robot = iphonoid()
    right, left, head = targets(robot, np.array([*hands[0], *hands[1], 0.0, rise])).reshape(3, 3)
    shoulder = np.array([0, robot.lengths.L12, robot.lengths.L01])
    reach = robot.lengths.L23 + robot.lengths.L34
    again = polar((right - shoulder * [1, -1, 1]) / reach * [1, -1, 1], (left - shoulder) / reach,
                  np.array([np.cos(turn) * np.cos(rise), np.sin(turn) * np.cos(rise),
                            np.sin(rise)]))  # fmt: skip
    assert again == pytest.approx(wanted, abs=1e-9)
    assert head[2] == pytest.approx(0.17 + 0.04 * np.sin(rise))


def test_the_example_of_the_documentation_is_a_gesture(tmp_path):
    page = Path(__file__).parents[2] / "docs" / "gestures.md"
    example = page.read_text(encoding="utf-8").split("```toml\n")[1].split("```")[0]
    file = tmp_path / "wave.toml"
    file.write_text(example, encoding="utf-8")
    assert load(file).name == "wave"
