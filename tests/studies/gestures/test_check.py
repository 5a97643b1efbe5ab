import numpy as np
import pytest

from miburi.bodies.rehearsal import rehearse
from miburi.feelings import FEELINGS
from miburi.gestures import key_poses, load
from miburi.studies.gestures.check import check, perform


@pytest.mark.parametrize("feeling", FEELINGS)
def test_every_gesture_keeps_its_promises(robot, feeling):
    assert list(check(robot, load(feeling), step=0.5)) == []


@pytest.mark.proof("test_every_gesture_keeps_its_promises")
@pytest.mark.parametrize("feeling", FEELINGS)
def test_every_gesture_keeps_its_promises_at_every_mood(robot, feeling):
    assert list(check(robot, load(feeling), step=0.05)) == []


@pytest.mark.parametrize("feeling", FEELINGS)
def test_no_variation_stops_or_meets_itself(robot, feeling):
    poses = key_poses(robot, load(feeling), 1.0, variation=1)
    paused, flowing = (rehearse(robot, poses, flows=flows) for flows in (False, True))
    for rehearsal in (paused, flowing):
        assert (rehearsal.stop, rehearsal.met) == (None, None)
    assert (len(flowing.angles) < len(paused.angles)) is any(pose.passes for pose in poses)


def test_a_gesture_that_crosses_its_arms_is_told_so(robot):
    function = load("fear")
    crossed = function.pose[0].model_copy(
        update={"right": [0.68, -0.42, -0.26], "left": [0.68, -0.42, -0.26]}
    )
    bad = function.model_copy(update={"pose": (crossed,), "repeat": None})
    assert any("meet" in problem for problem in check(robot, bad, step=0.5))


WRONG_WAY_OUT = """
name = "pride"
feeling = "happiness"
duration = 3.2

[effort]
space = 1.0
weight = 0.3
time = 0.3
flow = 0.6

[[pose]]
phase = 0.4
until = 0.5
right = [0.2, 0.7, -0.6]
left = [0.2, 0.7, -0.6]
head = [0.55, 0.0, 0.83]

[[pose]]
phase = 0.75
right = [0.25, -0.8, -0.5]
left = [0.25, 0.8, -0.5]
head = [0.5, -0.25, 0.83]
"""


def test_a_gesture_that_the_rule_stops_as_the_next_pose_begins_is_told_so(robot, tmp_path):
    """A minus sign in "out": the check itself ended with an error of the body's."""
    file = tmp_path / "pride.toml"
    file.write_text(WRONG_WAY_OUT, encoding="utf-8")
    problems = list(check(robot, load(file), step=0.2))
    assert any("contact rule stops it" in problem for problem in problems)


def test_a_gesture_that_does_not_grow_is_told_so(robot):
    function = load("surprise")
    effort = function.effort.model_copy(update={"space": 0.0})
    problems = list(check(robot, function.model_copy(update={"effort": effort}), step=0.5))
    assert any("does not use more space" in problem for problem in problems)


def test_happiness_fits_into_the_experiments_two_seconds(robot):
    performed = perform(robot, load("happiness"), 0.9)
    assert performed.measures.duration <= 1.95
    line = performed.as_json()
    assert {
        "feeling", "mood", "volume", "path", "mean_speed", "mean_acceleration", "mean_jerk",
        "directness", "ik_error_m", "self_collisions", "contact_stops",
    } <= set(line)  # fmt: skip
    assert all(np.isfinite(value) for key, value in line.items() if key != "feeling")
