"""When a sentence's syllables are said, and which of them stand out."""

import pytest

from miburi.languages import LANGUAGES
from miburi.languages.rhythm import rhythm_of, rhythm_of_sound


@pytest.mark.parametrize(
    ("text", "stands_out"),
    [
        ("My daughter is in the garden.", [1, 6]),
        ("I forgot about tomorrow.", [2, 6]),
        ("The little table wanted glasses.", [1, 3, 5, 7]),
        ("He sounded quite tired, maybe.", [1, 3, 4, 5]),
        ("It is for them and us.", []),
    ],
)
def test_the_words_that_matter_stand_out_where_they_are_stressed(
    text: str, stands_out: list[int]
) -> None:
    stretches = [float(k) for k in range(20)][: _COUNTS[text]]
    assert list(rhythm_of_sound(text, "en", [stretches], 9.0).prominent) == stands_out


_COUNTS = {
    "My daughter is in the garden.": 8,
    "I forgot about tomorrow.": 8,
    "The little table wanted glasses.": 9,
    "He sounded quite tired, maybe.": 6,
    "It is for them and us.": 6,
}


def test_a_pause_keeps_what_comes_after_it_in_its_place() -> None:
    """Of the first stretch one vowel more is heard than its letters tell."""
    prominent = rhythm_of_sound("Chocolate, please.", "en", [[0.1, 0.2, 0.3, 0.4], [1.5]], 2.0)
    assert prominent.prominent == (0.1, 1.5)
    # A voice that makes no pause there is followed all the same.
    assert rhythm_of_sound("Chocolate, please.", "en", [[0.1, 0.2, 0.5]], 2.0).prominent[-1] == 0.5


def test_signs_take_time_and_a_faster_voice_less() -> None:
    plain, parted = rhythm_of("Good night Anna", "en"), rhythm_of("Good night. Anna", "en")
    assert parted.seconds > plain.seconds + 0.2
    assert parted.prominent[:2] == plain.prominent[:2]
    assert rhythm_of("Good night Anna", "en", 2.0).seconds == pytest.approx(plain.seconds / 2)


@pytest.mark.parametrize(
    ("language", "text", "count"),
    [("ja", "今日は天気がいいですね。", 2), ("fr", "Je suis content de vous revoir.", 2)],
)
def test_other_languages_have_a_rhythm_of_their_own(language: str, text: str, count: int) -> None:
    said = rhythm_of(text, language)
    assert len(said.prominent) == count
    assert 1.0 < said.seconds < 4.0
    assert max(said.prominent) < said.seconds


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("text", ["", "…", "?!", "🎉", "42"])
def test_what_has_no_words_beats_nothing_that_is_late(language: str, text: str) -> None:
    said = rhythm_of(text, language)
    assert all(0 <= at <= said.seconds for at in said.prominent)
    assert rhythm_of_sound(text, language, [], 1.0).prominent == ()
