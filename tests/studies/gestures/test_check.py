import numpy as np
import pytest

from miburi.bodies.rehearsal import rehearse
from miburi.feelings import FEELINGS
from miburi.gestures import key_poses, load
from miburi.studies.gestures.check import check, moods, perform


def test_moods_run_from_0_to_1():
    assert moods(0.05)[0] == 0
    assert moods(0.05)[-1] == 1
    assert len(moods(0.05)) == 21
    assert 0.35 in moods(0.05)


@pytest.mark.parametrize("feeling", FEELINGS)
def test_every_gesture_keeps_its_promises(robot, feeling):
    assert list(check(robot, load(feeling), step=0.25)) == []


@pytest.mark.proof("test_every_gesture_keeps_its_promises")
@pytest.mark.parametrize("feeling", FEELINGS)
def test_every_gesture_keeps_its_promises_at_every_mood(robot, feeling):
    assert list(check(robot, load(feeling), step=0.05)) == []


@pytest.mark.parametrize("feeling", FEELINGS)
def test_no_variation_stops_or_meets_itself(robot, feeling):
    for seed, mood in enumerate((0.6, 1.0)):
        rehearsal = rehearse(robot, key_poses(robot, load(feeling), mood, variation=seed))
        assert rehearsal.stop is None
        assert rehearsal.met is None
        poses = key_poses(robot, load(feeling), mood, variation=seed)
        flowing = rehearse(robot, poses, flows=True)
        assert (flowing.stop, flowing.met) == (None, None)
        assert (len(flowing.angles) < len(rehearsal.angles)) is any(pose.passes for pose in poses)


def test_a_gesture_that_crosses_its_arms_is_told_so(robot):
    function = load("fear")
    crossed = function.pose[0].model_copy(
        update={"right": [0.68, -0.42, -0.26], "left": [0.68, -0.42, -0.26]}
    )
    bad = function.model_copy(update={"pose": (crossed,), "repeat": None})
    assert any("meet" in problem for problem in check(robot, bad, step=0.5))


def test_a_gesture_that_does_not_grow_is_told_so(robot):
    function = load("surprise")
    effort = function.effort.model_copy(update={"space": 0.0})
    problems = list(check(robot, function.model_copy(update={"effort": effort}), step=0.5))
    assert any("does not use more space" in problem for problem in problems)


def test_happiness_fits_into_the_experiments_two_seconds(robot):
    assert perform(robot, load("happiness"), 0.9).measures.duration <= 1.95


def test_the_line_of_measures_has_the_promised_keys(robot):
    line = perform(robot, load("disgust"), 0.5).as_json()
    assert {
        "feeling", "mood", "volume", "path", "mean_speed", "mean_acceleration", "mean_jerk",
        "directness", "ik_error_m", "self_collisions", "contact_stops",
    } <= set(line)  # fmt: skip
    assert all(np.isfinite(value) for key, value in line.items() if key != "feeling")
