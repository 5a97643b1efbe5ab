"""What both emotional models refuse, and that a refusal changes nothing."""

import pytest

from miburi.errors import InputError
from miburi.feelings import FEELINGS, EmotionalModel, Expression, SpikingModel, Stimulus

MODELS = [EmotionalModel, SpikingModel]
both = pytest.mark.parametrize("kind", MODELS)


@pytest.mark.parametrize("bad", [-0.1, 1.1, float("nan"), True, "0.5", None])
def test_a_strength_outside_its_range_is_refused(bad):
    with pytest.raises(InputError, match="strength must be a number from 0 to 1"):
        Stimulus("happiness", bad)


def test_the_error_for_an_unknown_feeling_or_source_lists_the_names():
    with pytest.raises(InputError, match=r"one of happiness, .* got 'joy'"):
        Stimulus("joy", 0.5)
    with pytest.raises(InputError, match=r"one of speech, .* got 'radio'"):
        Stimulus("fear", 0.5, "radio")
    with pytest.raises(InputError, match="got 'joy'"):
        Expression("joy", 0.5)


@both
@pytest.mark.parametrize("bad", [-1e-9, float("nan"), float("inf"), True, "1"])
def test_a_step_of_a_wrong_duration_is_refused(kind, bad):
    with pytest.raises(InputError, match="seconds"):
        kind().step(bad)


@both
def test_a_refused_state_changes_nothing(kind):
    model = kind()
    model.stimulate(Stimulus("fear", 0.8))
    model.step(60)
    before = model.save()
    with pytest.raises(InputError, match=r"got 1\.2"):
        model.set_state(emotion={"fear": 0.1}, mood={"fear": 1.2})
    assert model.save() == before


@both
@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("version", 1),
        ("model", "other"),
        ("time", -1),
        ("mood", [2.0] * 8),
        ("mood", [float("nan")] * 8),
        ("stale", [0.0] * 8),
        ("held", None),
        ("stale", "x"),
    ],
)
def test_a_state_of_another_version_or_model_is_refused(kind, key, value):
    state = kind().save()
    state[key] = value
    with pytest.raises(InputError, match="must"):
        kind.load(state)
    del state[key]
    for wrong in (state, [key]):
        with pytest.raises(InputError, match="must"):
            kind.load(wrong)


@both
def test_the_error_for_a_state_of_other_feelings_names_them(kind):
    state = kind().save()
    nine = {**state, "feelings": [*FEELINGS, "pride"], "mood": [0.0] * 9}
    with pytest.raises(InputError, match=r"feelings happiness, .* got .*'pride'.*MIBURI_FEELINGS"):
        kind.load(nine)
    with pytest.raises(InputError, match="feelings"):
        kind.load({**state, "feelings": FEELINGS[::-1]})
    del state["feelings"]  # as it was kept when there were only the paper's eight
    assert kind.load(state).save()["feelings"] == list(FEELINGS)


def test_a_state_whose_level_would_exceed_1_is_refused():
    state = EmotionalModel().save()
    state["levels"][2][0] = state["pending"][2][0] = 0.6
    with pytest.raises(InputError, match="must not exceed 1"):
        EmotionalModel.load(state)
