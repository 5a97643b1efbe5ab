import numpy as np
import pytest

from miburi.gestures import shipped_repertoire
from miburi.studies.gestures.classifier import NearestNeighbour, confusion, learn


def test_the_nearest_has_the_name():
    classifier = NearestNeighbour(np.array([[0.0, 100.0], [1.0, 100.5]]), ["low", "high"])
    assert classifier.name(np.array([0.2, 100.1])) == "low"
    assert classifier.name(np.array([0.9, 100.4])) == "high"


@pytest.mark.proof("test_the_nearest_has_the_name")
def test_gestures_are_told_apart_at_moods_and_variations_never_seen(robot):
    classifier = learn(robot, shipped_repertoire(), variations=1)
    for mood, least in ((0.7, 0.95), (0.3, 0.8)):
        table = confusion(robot, shipped_repertoire(), classifier, mood, variations=1)
        assert table.sum() == 8
        assert table.trace() >= least * 8
