import numpy as np
import pytest

from miburi.errors import InputError
from miburi.gestures import FEELINGS, key_poses, load
from miburi.robot import forward, iphonoid


@pytest.mark.parametrize("feeling", FEELINGS)
def test_mood_zero_is_exactly_neutral(feeling):
    neutral = forward(iphonoid(), iphonoid().neutral)
    for pose in key_poses(iphonoid(), load(feeling), 0.0):
        assert np.array_equal(pose.target, neutral)


@pytest.mark.parametrize("feeling", FEELINGS)
def test_a_gesture_ends_at_neutral(feeling):
    last = key_poses(iphonoid(), load(feeling), 0.9)[-1]
    assert np.array_equal(last.target, forward(iphonoid(), iphonoid().neutral))


def test_an_unknown_feeling_is_refused_with_the_list():
    with pytest.raises(InputError, match=r"no gesture for 'joy'.*happiness"):
        load("joy")


@pytest.mark.parametrize("mood", [-0.01, 1.01, float("nan")])
def test_a_mood_outside_0_to_1_is_refused(mood):
    with pytest.raises(InputError, match="from 0 to 1"):
        key_poses(iphonoid(), load("anger"), mood)
