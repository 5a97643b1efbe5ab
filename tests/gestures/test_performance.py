"""Performing a movement function at a membership μ."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from miburi import ik
from miburi.errors import InputError
from miburi.feelings import FEELINGS
from miburi.gestures import blend, coordinates, key_poses, load, membership
from miburi.gestures.coordinates import neutral
from miburi.robot import forward, iphonoid

ROBOT = iphonoid()
NEUTRAL = forward(ROBOT, ROBOT.neutral)

feelings = st.sampled_from(FEELINGS)
moods = st.floats(0, 1)
seeds = st.none() | st.integers(0, 10_000)


def targets(poses):
    return np.array([pose.target for pose in poses])


@settings(max_examples=50)
@given(feelings, moods, seeds)
@example("anger", 0.0, None)
@example("anger", 0.0, 1)
def test_every_key_pose_is_reached_without_a_flip_and_the_last_is_neutral(feeling, mood, variation):
    """A nearly straight arm could bend its fingertip backwards and still reach."""
    poses, present = key_poses(ROBOT, load(feeling), mood, variation=variation), ROBOT.neutral
    for pose in poses:
        solution = ik.solve(ROBOT, pose.target, start=present)
        present = solution.angles
        assert solution.error.max() <= 1e-3
        assert np.all((present >= ROBOT.lower) & (present <= ROBOT.upper))
        assert present[3] >= 0 >= present[6]
        if mood == 0:
            assert np.array_equal(pose.target, NEUTRAL)
    assert np.array_equal(poses[-1].target, NEUTRAL)


@pytest.mark.parametrize("feeling", FEELINGS)
def test_at_half_the_mood_hands_are_half_way_along_their_arcs(feeling):
    function = load(feeling).model_copy(update={"hedge": "plainly"})
    rest = neutral(ROBOT)
    for pose, written in zip(key_poses(ROBOT, function, 0.5), function.pose, strict=False):
        if function.repeat is None and function.effort.flow >= 0.5:
            middle = rest + 0.5 * (written.coordinates - rest)
            assert pose.target == pytest.approx(coordinates.targets(ROBOT, middle), abs=1e-12)


@pytest.mark.parametrize("feeling", FEELINGS)
def test_on_longer_arms_a_gesture_keeps_its_look(feeling, tall_file):
    """Hands are as many arm's reaches from their shoulders, in the same directions."""
    lengths = ROBOT.lengths.model_copy(update={"L23": 0.08, "L34": 0.08 * 4 / 3})
    long = ROBOT.model_copy(update={"lengths": lengths})
    function = load(feeling)
    for ours, theirs in zip(
        key_poses(ROBOT, function, 0.9), key_poses(long, function, 0.9), strict=True
    ):
        for hand, side in ((ours.right, -1), (ours.left, 1)):
            there = theirs.right if side < 0 else theirs.left
            turn = np.arctan2(ours.head[1], ours.head[0])
            shoulder = np.array([-np.sin(turn) * 0.05, np.cos(turn) * 0.05, 0]) * side + [
                0,
                0,
                0.12,
            ]
            assert (there - shoulder) / 4 * 3 == pytest.approx(hand - shoulder, abs=1e-9)
        assert theirs.head == pytest.approx(ours.head)
        assert ik.solve(long, theirs.target, start=long.neutral).error.max() < 1e-3


@settings(max_examples=40)
@given(feelings, moods, moods)
def test_more_mood_is_never_slower(feeling, one, other):
    function = load(feeling)
    low, high = sorted((one, other))
    slow, fast = key_poses(ROBOT, function, low), key_poses(ROBOT, function, high)
    for calm, excited in zip(slow, fast, strict=True):
        assert excited.duration <= calm.duration
        assert excited.hold <= calm.hold


@pytest.mark.parametrize("mood", [-0.01, 1.01, float("nan"), float("inf")])
def test_a_mood_outside_0_to_1_is_refused(mood):
    with pytest.raises(InputError, match="from 0 to 1"):
        key_poses(ROBOT, load("anger"), mood)


def test_hedges_shape_the_membership():
    function = load("fear")
    for hedge, expected in (("plainly", 0.64), ("very", 0.4096), ("more or less", 0.8)):
        hedged = function.model_copy(update={"hedge": hedge})
        assert membership(hedged, 0.64) == pytest.approx(expected)
        assert membership(hedged, 0.0) == 0.0
        assert membership(hedged, 1.0) == 1.0


def test_a_repeat_plays_its_key_poses_again():
    function = load("thrill")
    once = function.model_copy(update={"repeat": None})
    poses, single = targets(key_poses(ROBOT, function, 0.9)), targets(key_poses(ROBOT, once, 0.9))
    assert np.array_equal(poses, np.vstack([single[:4], single]))


def test_effort_shapes_any_gesture():
    def with_effort(**change):
        function = load("surprise")
        effort = function.effort.model_copy(update=change)
        return key_poses(ROBOT, function.model_copy(update={"effort": effort}), 1.0)

    small, large = with_effort(space=0.3), with_effort(space=0.9)
    assert np.linalg.norm(small[0].target - NEUTRAL) < np.linalg.norm(large[0].target - NEUTRAL)
    sustained, sudden = with_effort(time=0.0), with_effort(time=1.0)
    assert sudden[0].duration == pytest.approx(sustained[0].duration / 3)
    light, strong = with_effort(weight=0.0), with_effort(weight=1.0)
    assert strong[0].duration == pytest.approx(light[0].duration / 2)
    assert strong[0].duration + strong[0].hold == pytest.approx(light[0].duration + light[0].hold)
    bound, free = with_effort(flow=0.0), with_effort(flow=0.5)
    assert len(bound) == 2 * len(free)
    assert bound[0].hold > 0
    assert np.array_equal(bound[1].target, free[0].target)
    whole = [sum(pose.duration + pose.hold for pose in poses) for poses in (bound, free)]
    assert whole[0] == pytest.approx(whole[1])


@settings(max_examples=25)
@given(feelings, moods, seeds)
def test_a_blend_of_one_is_the_gesture_itself(feeling, mood, variation):
    function = load(feeling)
    blended = blend(ROBOT, [(function, mood), (load("anger"), 0.0)], variation=variation)
    alone = key_poses(ROBOT, function, mood, variation=variation)
    if mood > 0:
        assert targets(blended) == pytest.approx(targets(alone), abs=1e-12)


@settings(max_examples=30)
@given(feelings, feelings, moods, moods)
def test_every_blend_is_reachable_and_ends_at_neutral(one, other, mood, second):
    poses = blend(ROBOT, [(load(one), mood), (load(other), second)])
    for pose in poses:
        assert ik.solve(ROBOT, pose.target, start=ROBOT.neutral).error.max() <= 1e-3
    assert np.array_equal(poses[-1].target, NEUTRAL)


def test_a_blend_lies_between_its_parts():
    happy, sad = load("happiness"), load("sadness")
    head = [blend(ROBOT, [(happy, 0.8), (sad, mood)])[0].head[2] for mood in (0.0, 0.2, 0.7)]
    assert head[0] > head[1] > head[2]


def test_a_blend_of_nothing_is_refused():
    with pytest.raises(InputError, match="at least one"):
        blend(ROBOT, [])


def test_variation_is_seeded_and_small():
    function = load("happiness")
    written = targets(key_poses(ROBOT, function, 0.9))
    seven, again, eight = (
        targets(key_poses(ROBOT, function, 0.9, variation=seed)) for seed in (7, 7, 8)
    )
    assert np.array_equal(seven, again)
    assert not np.array_equal(seven, eight)
    assert 1e-3 < np.abs(seven - written).max() < 0.06
