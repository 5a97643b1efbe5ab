"""When a sentence's syllables are said, and which of them stand out."""

import pytest

from miburi.languages import folders
from miburi.languages.rhythm import rhythm_of, rhythm_of_sound

#: Everyday words whose second or third syllable is stressed, and others whose first is.
LATER = ["a-gain", "re-mem-ber", "to-mor-row", "hel-lo", "po-lice", "per-haps", "gui-tar"]
FIRST = [
    "al-ways", "an-gry", "a-ni-mal", "un-der", "in-teres-ting", "ex-cel-lent", "com-pa-ny",
    "com-pli-ca-ted", "per-fect", "pro-mise", "re-gion", "de-li-cate", "kit-chen", "daugh-ter",
]  # fmt: skip


@pytest.mark.parametrize(("words", "strong"), [(LATER, 1), (FIRST, 0)])
def test_a_word_is_stressed_at_its_beginning_or_is_known_not_to_be(
    words: list[str], strong: int
) -> None:
    for parts in words:
        vowels = [float(k) for k in range(len(parts.split("-")))]
        said = rhythm_of_sound(parts.replace("-", ""), "en", [vowels], 9.0)
        assert said.prominent == (strong,), parts


@pytest.mark.parametrize(
    ("text", "heard", "stands_out"),
    [
        ("My daughter is in the garden.", 8, [1, 6]),
        ("The little table wanted glasses.", 9, [1, 3, 5, 7]),
        ("He sounded quite tired, maybe.", 7, [1, 3, 4, 5]),
        ("Goodbye, the café is closed.", 7, [1, 3, 6]),
        ("It is for them and us.", 6, []),
        ("It’s for you, I’m sure.", 5, [4]),
        ("It is 12:45, Anna.", 8, [2, 6]),
    ],
)
def test_the_words_that_matter_stand_out(text: str, heard: int, stands_out: list[int]) -> None:
    one = [float(k) for k in range(heard)]
    assert list(rhythm_of_sound(text, "en", [one], 9.0).prominent) == stands_out


def test_a_pause_keeps_what_comes_after_it_in_its_place() -> None:
    """In the first stretch more vowels are heard than its letters tell."""
    stretches = [[0.0, 0.1, 0.2, 0.3, 0.4, 0.5], [1.0, 1.1, 1.2]]
    said = rhythm_of_sound("See me, Anna came", "en", stretches, 2.0)
    assert said.prominent == (0.0, 1.0, 1.2)
    # A voice that makes no pause there is followed all the same.
    said = rhythm_of_sound("See me, Anna", "en", [[0.1, 0.2, 0.5, 0.7]], 2.0)
    assert said.prominent == (0.1, 0.5)


def test_signs_take_time_and_a_faster_voice_less() -> None:
    plain, parted = rhythm_of("Good night Anna", "en"), rhythm_of("Good night. Anna", "en")
    assert parted.seconds > plain.seconds + 0.2
    assert parted.prominent[:2] == plain.prominent[:2]
    assert rhythm_of("Good night Anna", "en", 2.0).seconds == pytest.approx(plain.seconds / 2)


@pytest.mark.parametrize(
    ("language", "text", "count"),
    [
        ("ja", "今日は天気がいいですね。", 2),
        ("ja", "コーヒーはパーティーで。", 2),
        ("fr", "Je suis content de vous revoir.", 2),
        ("fr", "Aujourd'hui l'école est ouverte.", 3),
    ],
)
def test_other_languages_have_a_rhythm_of_their_own(language: str, text: str, count: int) -> None:
    said = rhythm_of(text, language)
    assert len(said.prominent) == count
    assert 1.0 < said.seconds < 4.0
    assert max(said.prominent) < said.seconds


def test_a_mute_e_is_not_stressed_in_french() -> None:
    (at,) = rhythm_of("école", "fr").prominent
    end = rhythm_of("école", "fr").seconds
    assert at < end - 0.1


@pytest.mark.parametrize("language", folders())
@pytest.mark.parametrize("text", ["", "…", "?!", "🎉", "42"])
def test_what_has_no_words_beats_nothing_that_is_late(language: str, text: str) -> None:
    said = rhythm_of(text, language)
    assert all(0 <= at <= said.seconds for at in said.prominent)
    assert set(rhythm_of_sound(text, language, [[0.5]], 1.0).prominent) <= {0.5}
