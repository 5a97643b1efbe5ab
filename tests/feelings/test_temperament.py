from importlib import resources

import numpy as np
import pytest

from miburi.errors import DescriptionError, InputError
from miburi.feelings import (
    FEELINGS,
    SOURCES,
    TEMPERAMENTS,
    load_temperament,
    shipped_temperament,
)


@pytest.fixture
def text():
    return (resources.files("miburi.feelings") / "temperaments" / "default.toml").read_text()


@pytest.mark.parametrize("name", TEMPERAMENTS)
def test_a_shipped_temperament_is_complete_and_has_the_name_of_its_file(name):
    character = shipped_temperament(name)
    assert character.name == name
    assert character.fading.shape == (3, 8)
    assert character.weights.shape == (len(SOURCES),)
    np.testing.assert_array_equal(np.diag(character.matrix), np.ones(8))
    happy, sad = FEELINGS.index("happiness"), FEELINGS.index("sadness")
    assert character.matrix[happy, sad] < 0
    assert character.matrix[sad, happy] < 0
    assert character.fading.argmin(axis=1).tolist() == [FEELINGS.index("surprise")] * 3
    with pytest.raises(ValueError, match="read-only"):
        character.matrix[0, 0] = 2


def test_the_error_for_an_unknown_name_lists_the_names():
    with pytest.raises(InputError, match="'wild'; use one of default, calm, lively"):
        shipped_temperament("wild")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("threshold = 0.05", "threshold = 0.0", ["threshold = 0.0", "0.001"]),
        ("threshold = 0.05", "treshold = 0.05", ["treshold", "not a known key", "threshold"]),
        ("emotion = 10.0", "emotion = 200.0", ["at least twice as long", "200.0", "300.0"]),
        ("mood = 0.06", "mood = 0.3", ["mood must not exceed feeling", "0.3"]),
        ("face = 0.7\n", "", ["sources", "face", "missing"]),
        (
            "face = 0.7",
            "radio = 0.7",
            ["radio", "'speech', 'face', 'touch', 'application' or 'talk'"],
        ),
        ("disgust = 0.5\n", "", ["lasting", "disgust", "missing"]),
        ("disgust = 0.5\n", "joy = 0.5\n", ["lasting.joy", "'happiness'", "'surprise'"]),
        ("fear = 0.6\nthrill = -", "joy = 0.6\nthrill = -", ["effects.fright.joy", "'happiness'"]),
        (
            "fear = 0.6\nthrill = -",
            "fright = 0.6\nthrill = -",
            ["fright must not act on itself", "0.6"],
        ),
    ],
)
def test_the_error_for_a_wrong_file_names_file_key_value_and_range(tmp_path, text, old, new, words):
    assert old in text
    path = tmp_path / "mine.toml"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(DescriptionError) as refused:
        load_temperament(path)
    for word in [str(path), *words]:
        assert word in str(refused.value)
