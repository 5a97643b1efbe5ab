"""What the paper says, and the invariants, for both emotional models."""

import json
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from miburi.feelings import (
    FEELINGS,
    SOURCES,
    TEMPERAMENTS,
    EmotionalModel,
    Expression,
    FeelingModel,
    SpikingModel,
    Stimulus,
    shipped_temperament,
)

MODELS = [EmotionalModel, SpikingModel]
both = pytest.mark.parametrize("kind", MODELS)
HAPPY, FRIGHT, FEAR, ANGER = (
    FEELINGS.index(name) for name in ("happiness", "fright", "fear", "anger")
)
CHARACTERS = {name: shipped_temperament(name) for name in TEMPERAMENTS}

stimuli = st.builds(Stimulus, st.sampled_from(FEELINGS), st.floats(0, 1), st.sampled_from(SOURCES))
seconds = st.one_of(st.floats(0, 30), st.floats(0, 100_000))
lives = st.lists(st.one_of(stimuli, seconds, st.just("contact")), max_size=12)


def live(model: FeelingModel, events) -> FeelingModel:
    for event in events:
        if isinstance(event, Stimulus):
            model.stimulate(event)
        elif event == "contact":
            model.contact()
        else:
            model.step(event)
    return model


def levels(model: FeelingModel) -> np.ndarray:
    return np.stack([model.emotion, model.feeling, model.mood])


def risen(model: FeelingModel, feeling: int) -> float:
    """Return how far a mood is above rest."""
    return float(model.mood[feeling] - model.temperament.rest[feeling])


def talk(model: FeelingModel, feeling: str, minutes: float, strength: float = 0.8) -> None:
    for _ in range(round(minutes * 4)):
        model.stimulate(Stimulus(feeling, strength, "speech"))
        model.step(15)


# What the paper says.


@both
def test_a_happy_remark_makes_a_happy_emotion_at_once_but_a_happy_mood_needs_long(kind):
    model = kind()
    model.stimulate(Stimulus("happiness", 0.8, "speech"))
    assert model.emotion[HAPPY] == pytest.approx(0.8)
    assert risen(model, HAPPY) == 0
    most = 0.0
    for _ in range(600):
        model.step(10)
        most = max(most, risen(model, HAPPY))
    assert 0 < most < 0.03
    talk(model, "happiness", 30)
    assert model.mood[HAPPY] > 0.75


@both
def test_each_level_rises_later_and_lasts_longer_than_the_one_before(kind):
    model = kind()
    talk(model, "happiness", 3)
    over_time = np.array([levels(model)[:, HAPPY] for _ in range(1500) if not model.step(10)])
    over_time[:, 2] -= model.temperament.rest[HAPPY]
    peaks = over_time.argmax(axis=0)
    assert peaks[0] <= peaks[1] < peaks[2]
    fades = [int(np.argmax(over_time[p:, k] < over_time[p, k] / np.e)) for k, p in enumerate(peaks)]
    assert 2 * fades[0] < fades[1]
    assert 2 * fades[1] < fades[2]


@both
def test_the_emotion_picks_the_gesture_and_its_mood_the_intensity(kind):
    model = kind()
    model.set_state(emotion={"anger": 0.6, "happiness": 0.5}, mood={"anger": 0.2, "happiness": 0.9})
    assert model.express() == Expression("anger", 0.2)
    model.set_state(emotion=dict.fromkeys(reversed(FEELINGS), 0.5))
    assert model.express().feeling == FEELINGS[0]


@both
def test_the_body_is_neutral_before_a_stimulus_and_soon_after_it(kind):
    model = kind()
    assert model.express() is None
    threshold = model.temperament.threshold
    model.set_state(emotion={"fear": threshold})
    assert model.express().feeling == "fear"
    model.set_state(emotion={"fear": np.nextafter(threshold, 0)})
    assert model.express() is None
    model.stimulate(Stimulus("happiness", 0.8))
    model.step(20)
    assert model.express().feeling == "happiness"
    model.step(20)
    assert model.express() is None


@both
def test_each_contact_takes_a_fifth_of_every_mood_but_no_emotion_or_feeling(kind):
    model = kind()
    for name in FEELINGS:
        talk(model, name, 2)
    before = levels(model)
    model.contact()
    model.contact()
    np.testing.assert_allclose(model.mood, 0.64 * before[2], rtol=1e-14)
    np.testing.assert_array_equal(levels(model)[:2], before[:2])


@both
def test_a_held_emotion_and_mood_stay_and_only_contact_lowers_the_mood(kind):
    model = kind()
    model.set_state(emotion={"happiness": 1.0}, mood={"happiness": 0.9}, hold=True)
    for _ in range(300):
        model.step(0.1)
    assert model.express() == Expression("happiness", 0.9)
    model.stimulate(Stimulus("sadness", 1.0))
    assert model.express() == Expression("happiness", 0.9)
    model.contact()
    assert model.express().mood == pytest.approx(0.72, abs=1e-15)
    model.step(10)
    assert 0.72 < model.express().mood < 0.721
    model.set_state(emotion={"happiness": 1.0})
    model.step(60)
    assert model.express() is None


@both
@pytest.mark.parametrize("name", TEMPERAMENTS)
def test_a_partner_begins_in_its_resting_mood_so_that_a_first_remark_is_seen(kind, name):
    model = kind(CHARACTERS[name])
    assert model.mood.tolist() == [CHARACTERS[name].resting[feeling] for feeling in FEELINGS]
    model.stimulate(Stimulus("happiness", 0.8, "speech"))
    assert model.express().mood >= 0.4


@both
@pytest.mark.parametrize("mood", [0.0, 0.2, 1.0])
def test_every_mood_goes_back_to_rest_with_the_moods_time_constant(kind, mood):
    model = kind()
    model.set_state(mood=dict.fromkeys(FEELINGS, mood))
    rest = model.temperament.rest
    np.testing.assert_allclose(model.mood, mood, rtol=1e-12)
    model.step(3600)
    apart = np.exp(-3600 / model.temperament.fading[2])
    np.testing.assert_allclose(model.mood, rest + (mood - rest) * apart, rtol=1e-12)


@both
@pytest.mark.parametrize("mood", [0.0, 0.9])
def test_a_contact_lowers_the_mood_that_is_shown_and_no_later_gain(kind, mood):
    touched, spared = kind(), kind()
    for model in (touched, spared):
        model.set_state(mood={"happiness": mood})
    touched.contact()
    loss = 0.2 * mood
    assert touched.mood[HAPPY] == pytest.approx(mood - loss)
    for model in (touched, spared):
        talk(model, "happiness", 20)
    healed = loss * np.exp(-1200 / touched.temperament.fading[2, HAPPY])
    assert spared.mood[HAPPY] - touched.mood[HAPPY] == pytest.approx(healed, abs=1e-12)


@both
def test_an_emotion_that_stays_becomes_a_feeling_and_then_a_mood(kind):
    """The paper: the mood "is created by a repetition of the same emotions"."""
    model = kind()
    model.step(60)
    model.set_state(emotion={"happiness": 1.0}, hold=True)
    rest = model.temperament.rest[HAPPY]
    model.step(60)
    assert model.feeling[HAPPY] > 0.5
    assert model.mood[HAPPY] < rest + 0.1
    model.step(3600)
    assert model.feeling[HAPPY] > 0.8
    assert model.mood[HAPPY] > rest + 0.8 * (1 - rest)


# What feelings do to each other.


@both
def test_joy_and_sadness_inhibit_each_other_on_every_level(kind):
    for one, other in [("happiness", "sadness"), ("sadness", "happiness")]:
        moved, spared = kind(), kind()
        talk(moved, one, 10)
        talk(spared, one, 10)
        row = FEELINGS.index(one)
        talk(moved, other, 1)
        spared.step(60)
        assert np.all(levels(moved)[:, row] < levels(spared)[:, row])


@both
def test_a_sad_word_also_lowers_the_happiness_that_the_mood_has_yet_to_take_up(kind):
    consoled, happy = kind(), kind()
    for model in (consoled, happy):
        model.stimulate(Stimulus("happiness", 0.9))
    consoled.stimulate(Stimulus("sadness", 0.9))
    for model in (consoled, happy):
        model.step(900)
    assert consoled.mood[HAPPY] < 0.98 * happy.mood[HAPPY]


@both
def test_setting_a_level_drops_what_it_has_yet_to_take_up(kind):
    model = kind()
    talk(model, "happiness", 5)
    model.set_state(emotion={}, feeling={}, mood={})
    model.step(600)
    expected = model.temperament.rest * -np.expm1(-600 / model.temperament.fading[2])
    np.testing.assert_allclose(levels(model), [0 * expected, 0 * expected, expected], atol=1e-15)


@both
def test_fright_feeds_fear_which_outlasts_it(kind):
    model = kind()
    model.stimulate(Stimulus("fright", 0.9))
    assert 0 < model.emotion[FEAR] < model.emotion[FRIGHT]
    assert model.express().feeling == "fright"
    model.step(12)
    assert model.express().feeling == "fear"


@both
def test_temperaments_behave_as_their_names_say(kind):
    moods = {}
    for name, character in CHARACTERS.items():
        model = kind(character)
        talk(model, "happiness", 10)
        moods[name] = risen(model, HAPPY)
    assert moods["calm"] < 0.6 * moods["default"]
    assert moods["default"] < 0.9 * moods["lively"]


@both
def test_a_repeated_stimulus_grows_stale_and_becomes_new_again(kind):
    model = kind()
    jumps = []
    for _ in range(4):
        model.stimulate(Stimulus("anger", 0.5, "speech"))
        jumps.append(model.emotion[ANGER])
        model.set_state(emotion={})
    assert jumps == sorted(jumps, reverse=True)
    assert jumps[3] < 0.8 * jumps[0]
    model.stimulate(Stimulus("anger", 0.5, "application"))
    assert model.emotion[ANGER] == pytest.approx(jumps[0])
    model.step(3600)
    model.stimulate(Stimulus("anger", 0.5, "speech"))
    assert model.emotion[ANGER] == pytest.approx(jumps[0])


@both
def test_sources_have_the_weights_of_the_temperament(kind):
    for source in SOURCES:
        model = kind()
        model.stimulate(Stimulus("fear", 0.5, source))
        assert model.emotion[FEAR] == pytest.approx(0.5 * model.temperament.sources[source])


@both
def test_another_temperament_acts_from_the_moment_it_is_assigned(kind):
    lively = shipped_temperament("lively")
    model, unchanged = kind(), kind()
    for each in (model, unchanged):
        talk(each, "happiness", 5)
        each.step(7)
    before = levels(model)
    model.temperament = lively
    np.testing.assert_array_equal(levels(model), before)
    reference = kind.load(unchanged.save(), lively)
    for each in (model, reference, unchanged):
        each.step(400)
        talk(each, "anger", 3)
    np.testing.assert_allclose(levels(model), levels(reference), rtol=0, atol=1e-9)
    assert np.abs(levels(model) - levels(unchanged)).max() > 0.1


# Invariants.


@both
@settings(max_examples=30, deadline=None)
@given(events=lives, character=st.sampled_from(TEMPERAMENTS))
def test_every_level_stays_between_0_and_1_and_the_expression_fits(kind, events, character):
    model = kind(CHARACTERS[character])
    for event in events:
        live(model, [event])
        assert np.all((levels(model) >= 0) & (levels(model) <= 1))
        shown = model.express()
        if shown is not None:
            assert shown.feeling == FEELINGS[int(model.emotion.argmax())]
            assert shown.mood == model.mood[FEELINGS.index(shown.feeling)]


@both
def test_what_one_feeling_takes_from_anothers_mood_does_not_depend_on_the_steps(kind):
    """The loss heals from when it came, not from the step's beginning."""
    apart, together = kind(), kind()
    for model in (apart, together):
        for _ in range(12):
            model.stimulate(Stimulus("happiness", 1.0))
            model.step(5.0)
    for _ in range(600):
        apart.step(1.0)
    together.step(600.0)
    assert together.mood.min() < 0.5
    np.testing.assert_allclose(apart.mood, together.mood, rtol=0, atol=1e-12)


@both
@settings(max_examples=40, deadline=None)
@given(events=lives, a=seconds, b=seconds)
def test_two_steps_equal_one(kind, events, a, b):
    apart, together = live(kind(), events), live(kind(), events)
    apart.step(a)
    apart.step(b)
    together.step(a + b)
    np.testing.assert_allclose(levels(apart), levels(together), rtol=0, atol=1e-12)
    assert apart.time == pytest.approx(together.time)


@both
@settings(max_examples=20, deadline=None)
@given(events=lives, stimulus=stimuli)
def test_a_stimulus_never_lowers_its_own_emotion_nor_moves_mood_up_at_once(kind, events, stimulus):
    model = live(kind(), events)
    before = levels(model)
    model.stimulate(stimulus)
    own = FEELINGS.index(stimulus.feeling)
    assert model.emotion[own] >= before[0, own]
    assert np.all(model.mood <= before[2] + 0.025)  # one spike of the feeling at most


@both
@settings(max_examples=20, deadline=None)
@given(events=lives)
def test_left_alone_everything_comes_to_rest(kind, events):
    model = live(kind(), events)
    model.step(3_000_000)
    assert np.all(levels(model)[:2] < 1e-9)
    np.testing.assert_allclose(model.mood, model.temperament.rest, atol=1e-9)
    assert model.express() is None


@both
@settings(max_examples=20, deadline=None)
@given(events=lives, away=seconds, later=lives)
def test_a_saved_model_ages_by_the_time_away(kind, events, away, later):
    model = live(kind(), events)
    again = kind.load(json.loads(json.dumps(model.save())), away=away)
    model.step(away)
    np.testing.assert_allclose(levels(again), levels(model), rtol=0, atol=1e-12)
    live(model, later)
    live(again, later)
    np.testing.assert_allclose(levels(again), levels(model), rtol=0, atol=1e-9)


@both
def test_a_held_state_survives_saving(kind):
    model = kind()
    model.set_state(emotion={"thrill": 0.8}, hold=True)
    assert kind.load(model.save(), away=100).express().feeling == "thrill"


@pytest.mark.parametrize("held", [None, "emotion", "feeling"])
@pytest.mark.parametrize("value", [0.02, 0.3, 1.0])
def test_the_cascade_is_the_exact_solution_of_its_equations(held, value):
    model = EmotionalModel()
    model.stimulate(Stimulus("happiness", 1.0))
    te, tf, tm = model.temperament.fading[:, HAPPY]
    a, b = model.temperament.take_up.feeling, model.temperament.take_up.mood
    # emotion, to feel, feeling, to be mood, mood, and 1
    start = np.array([1, a, 0, b, 0, 1])
    rates = np.diag([-1 / te, -1 / te, -1 / tf, -1 / tf, -1 / tm, 0])
    rates[2, 1], rates[4, 3] = 1 / te, 1 / tf
    if held == "emotion":
        model.set_state(emotion={"happiness": value}, hold=True)
        rates[0, 0], start[0] = 0, value
        rates[1, [1, 2, 5]] += a * value / te * np.array([-1, -1, 1])
        rates[3, [3, 4, 5]] += b * value / te * np.array([-1, -1, 1])
    if held == "feeling":
        model.set_state(feeling={"happiness": value}, hold=True)
        rates[2, 1], rates[2, 2], start[2] = 0, 0, value
        start[3] += b / a * value * (1 - b)
        rates[3, [3, 4, 5]] += b / a * value / tf * np.array([-1, -1, 1])
    rest = model.temperament.rest[HAPPY]
    for dt in (0.01, 1, 30, 600, 7200):
        again = EmotionalModel.load(model.save(), away=dt)
        expected = (expm(rates * dt) @ start)[[0, 2, 4]]
        expected[2] = rest + (1 - rest) * expected[2]
        np.testing.assert_allclose(levels(again)[:, HAPPY], expected, rtol=1e-9, atol=1e-13)


@both
def test_a_model_goes_to_another_process_after_its_first_step(kind: type[FeelingModel]) -> None:
    model = kind()
    model.stimulate(Stimulus("happiness", 0.8, "speech"))
    model.step(1.0)
    again = pickle.loads(pickle.dumps(model))
    for each in (model, again):
        each.step(1.0)
    np.testing.assert_array_equal(levels(model), levels(again))
