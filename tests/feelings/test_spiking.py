"""The spiking model alone; the tests of both models are in test_model.py."""

import numpy as np
import pytest

from miburi.feelings import FEELINGS, EmotionalModel, SpikingModel, Stimulus

HAPPY, SURPRISE, THRILL = (FEELINGS.index(name) for name in ("happiness", "surprise", "thrill"))


def test_a_stimulus_below_the_neurons_threshold_leaves_no_trace():
    model = SpikingModel()
    model.stimulate(Stimulus("happiness", 0.09))
    assert model.emotion[HAPPY] == pytest.approx(0.09)
    model.step(600)
    assert model.feeling[HAPPY] == 0


def test_stronger_emotions_fire_more_often():
    reached = []
    for strength in (0.2, 0.4, 0.6, 0.8):
        model = SpikingModel()
        model.stimulate(Stimulus("happiness", strength))
        model.step(30)
        reached.append(model.feeling[HAPPY])
    assert np.all(np.diff(reached) > 0.01)


def test_feelings_that_occur_together_are_learned_and_forgotten():
    model = SpikingModel()
    for _ in range(40):
        model.stimulate(Stimulus("surprise", 0.9))
        model.stimulate(Stimulus("happiness", 0.6))
        model.step(20)
    way = model.save()["learned"][0][SURPRISE][HAPPY]
    assert way > 0.05
    model.step(86_400)
    assert 0.2 * way < model.save()["learned"][0][SURPRISE][HAPPY] < 0.4 * way
    model = SpikingModel.load(model.save())
    fresh = SpikingModel()
    for each in (model, fresh):
        each.set_state(emotion={"surprise": 1.0}, feeling={}, mood={})
        each.step(20)
    assert model.feeling[HAPPY] > fresh.feeling[HAPPY] == 0


def test_inhibiting_connections_are_never_learned():
    model = SpikingModel()
    for _ in range(40):
        model.stimulate(Stimulus("happiness", 0.9))
        model.stimulate(Stimulus("sadness", 0.9))
        model.step(20)
    learned = np.array(model.save()["learned"])
    assert np.all(learned[:, model.temperament.matrix < 0] == 0)


def test_it_expresses_the_same_feelings_as_the_cascade():
    spiking, cascade = SpikingModel(), EmotionalModel()
    for model in (spiking, cascade):
        for _ in range(80):
            model.stimulate(Stimulus("happiness", 0.7, "speech"))
            model.step(15)
    assert spiking.mood[HAPPY] == pytest.approx(cascade.mood[HAPPY], abs=0.15)
    assert spiking.mood.argmax() == cascade.mood.argmax() == HAPPY
    rest = spiking.temperament.rest
    assert (spiking.mood - rest)[THRILL] < 0.5 * (spiking.mood - rest)[HAPPY]
