import numpy as np
import pytest

from miburi.errors import InputError
from miburi.feelings import FEELINGS, EmotionalModel, Expression, Stimulus


def test_a_happy_remark_makes_a_happy_emotion_at_once_and_a_happy_mood_much_later():
    model = EmotionalModel()
    model.stimulate(Stimulus("happiness", 0.8, "speech"))
    assert model.emotion[0] == pytest.approx(0.8)
    assert model.mood[0] == 0
    expression = model.express()
    assert expression == Expression("happiness", 0.0)


def test_the_experiment_keeps_its_emotion_and_loses_mood_only_to_contact():
    model = EmotionalModel()
    model.set_state(emotion={"happiness": 1.0}, mood={"happiness": 0.9}, hold=True)
    model.step(30)
    assert model.express() == Expression("happiness", 0.9)
    model.contact()
    assert model.express().mood == pytest.approx(0.72, abs=1e-15)
    model.step(1)
    assert 0.72 < model.express().mood < 0.7202


def test_two_steps_equal_one():
    model, other = EmotionalModel(), EmotionalModel()
    for each in (model, other):
        each.stimulate(Stimulus("fright", 0.9, "touch"))
        each.contact()
    model.step(7.3)
    model.step(3000.1)
    other.step(3007.4)
    for level in ("emotion", "feeling", "mood"):
        np.testing.assert_allclose(getattr(model, level), getattr(other, level), atol=1e-12)


@pytest.mark.parametrize("bad", [-0.1, 1.1, float("nan"), True, "0.5", None])
def test_a_strength_outside_its_range_is_refused(bad):
    with pytest.raises(InputError, match="from 0 to 1"):
        Stimulus(FEELINGS[0], bad)
