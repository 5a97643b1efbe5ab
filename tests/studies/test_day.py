import csv

import numpy as np
import pytest
from PIL import Image
from tests.fixtures.command import miburi

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


def test_the_command_writes_the_levels_beside_the_picture(tmp_path):
    assert miburi("feelings", "day", "--seed", "1", "--out", tmp_path).returncode == 0
    rows = list(csv.DictReader((tmp_path / "day.csv").read_text("utf-8").splitlines()))
    day = live_day(EmotionalModel(), seed=1)
    moods = [float(row["mood_happiness"]) for row in rows]
    np.testing.assert_allclose(moods, day.levels[:, 2, FEELINGS.index("happiness")], atol=1e-6)
    shown = [FEELINGS[which] if which >= 0 else "" for which in day.shown]
    assert [row["shown"] for row in rows] == shown
    with Image.open(tmp_path / "day.png") as picture:
        assert picture.text["command"].startswith("miburi feelings day --seed 1 --temperament def")
        assert "temperament_checksum" in picture.text
