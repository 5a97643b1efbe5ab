"""An impression says what was shown, and the temperament what it does to the partner."""

from importlib import resources
from pathlib import Path

import pytest

from miburi.errors import DescriptionError, InputError
from miburi.feelings import FEELINGS, Stimulus, load_temperament, shipped_temperament
from miburi.senses import Brought, Impression, stimuli


def written(folder: Path, rows: str) -> Path:
    """A copy of the default temperament with rows of its own."""
    text = (resources.files("miburi.feelings") / "temperaments" / "default.toml").read_text("utf-8")
    path = folder / "mine.toml"
    path.write_text(text + rows, encoding="utf-8")
    return path


@pytest.mark.parametrize("feeling", FEELINGS)
def test_a_feeling_is_contagious_unless_the_temperament_says_otherwise(feeling: str) -> None:
    heard = Impression(feeling, 0.8, "speech")
    assert stimuli(heard, shipped_temperament()) == (Stimulus(feeling, 0.8, "speech"),)


def test_a_gentle_partner_meets_anger_with_fear_and_sadness() -> None:
    sadness, fear = stimuli(Impression("anger", 0.5, "speech"), shipped_temperament("calm"))
    assert (sadness.feeling, sadness.strength) == ("sadness", pytest.approx(0.15))
    assert (fear.feeling, fear.strength) == ("fear", pytest.approx(0.2))


def test_an_empty_row_leaves_the_partner_cold(tmp_path: Path) -> None:
    cold = load_temperament(written(tmp_path, "[empathy.disgust]\n"))
    assert stimuli(Impression("disgust", 0.9, "face"), cold) == ()


def test_nothing_clear_does_nothing() -> None:
    assert stimuli(Impression(None, 0.3, "speech"), shipped_temperament()) == ()


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("[empathy.anger]\nfear = 1.1\n", ["empathy.anger.fear = 1.1", "less than or equal to 1"]),
        ("[empathy.anger]\nfear = -0.1\n", ["empathy.anger.fear = -0.1", "equal to 0"]),
        ("[empathy.rage]\nfear = 0.1\n", ["empathy.rage", "'happiness'"]),
        ("[empathy.anger]\nrage = 0.1\n", ["empathy.anger.rage", "'happiness'"]),
    ],
)
def test_a_wrong_table_is_refused_in_words(tmp_path: Path, rows: str, words: list[str]) -> None:
    with pytest.raises(DescriptionError) as refused:
        load_temperament(written(tmp_path, rows))
    for word in words:
        assert word in str(refused.value)


def test_the_reason_is_a_sentence() -> None:
    why = (Brought("lovely", 2.5), Brought("thank you", 1.5))
    assert Impression("happiness", 0.8, "speech", why).reason == (
        "'lovely' and 'thank you': happiness 0.80"
    )
    assert Impression(None, 0.1, "speech").reason == "nothing clear"


@pytest.mark.parametrize(
    ("feeling", "strength", "source"),
    [("boredom", 0.5, "speech"), ("fear", 1.1, "speech"), ("fear", 0.5, "radio"),
     (None, -0.1, "speech"), (None, 0.5, "radio")],
)  # fmt: skip
def test_a_wrong_impression_is_refused(feeling: str | None, strength: float, source: str) -> None:
    with pytest.raises(InputError):
        Impression(feeling, strength, source)
