import numpy as np
import pytest

from miburi.feelings import FEELINGS, EmotionalModel, SpikingModel
from miburi.studies.day import live_day


@pytest.fixture(scope="module", params=[EmotionalModel, SpikingModel])
def day(request):
    return live_day(request.param())


def most_risen(day, start, hour):
    """Return the feeling whose mood rose most from one time to another."""
    before, after = np.searchsorted(day.hours, [start, hour])
    return FEELINGS[int((day.levels[after, 2] - day.levels[before, 2]).argmax())]


def test_each_episode_leaves_its_mood(day):
    for start, hour, mood in (
        (8.2, 8.7, "happiness"),
        (10.7, 11.5, "sadness"),
        (12.9, 13.4, "happiness"),
        (15.4, 15.9, "anger"),
        (16.9, 18, "happiness"),
    ):
        assert most_risen(day, start, hour) == mood


def test_the_night_begins_calm_and_only_the_mood_remembers(day):
    assert day.shown[-1] == -1
    assert day.levels[-1, :2].max() < 0.01
    assert np.abs(day.levels[-1, 2] - 0.5).max() > 0.02


def test_blocked_gestures_leave_steps_of_a_fifth_in_the_mood(day):
    assert len(day.contacts) == 3
    for contact in day.contacts:
        before = np.searchsorted(day.hours, contact, side="left") - 1
        after = np.searchsorted(day.hours, contact, side="right") - 1
        assert 0.795 < day.levels[after, 2, 0] / day.levels[before, 2, 0] < 0.815


def test_the_seed_alone_shifts_the_stimuli():
    one, same, other = (live_day(EmotionalModel(), seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.levels, same.levels)
    assert not np.array_equal(one.hours, other.hours)
