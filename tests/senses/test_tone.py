"""Tone of voice: it weighs what the words say, and says nothing by itself."""

import numpy as np
import pytest
from tests.fixtures.live import Server
from tests.fixtures.speech import recognising, speak
from tests.fixtures.waiting import post

import miburi
from miburi.senses.tone import ToneOfVoice, coloured, measure_prosody
from miburi.senses.words import hear


def tone(pitch: float, loudness: float, seconds: float = 1.0) -> bytes:
    """A voice of straw: a pulse's first ten overtones, as loud as so many dB below full scale."""
    time = np.arange(round(16_000 * seconds)) / 16_000
    wave = sum(np.sin(2 * np.pi * pitch * n * time) / n for n in range(1, 11))
    wave = wave / np.sqrt(np.mean(wave**2)) * 10 ** (loudness / 20)
    return (32_767 * wave).clip(-32_767, 32_767).astype(np.int16).tobytes()


@pytest.mark.parametrize(("pitch", "loudness"), [(80.0, -40.0), (205.0, -20.0), (330.0, -40.0)])
def test_loudness_and_pitch_are_measured(pitch: float, loudness: float) -> None:
    voice = measure_prosody(tone(pitch, loudness))
    assert voice is not None
    assert voice.pitch == pytest.approx(pitch, rel=0.03)
    assert voice.loudness == pytest.approx(loudness, abs=0.5)


def test_silence_has_no_tone() -> None:
    for sound in (b"", b"\0", bytes(100), bytes(64_000)):
        assert measure_prosody(sound) is None
        assert ToneOfVoice().take(sound) == "plain"


@pytest.mark.parametrize(
    ("pitch", "loudness", "expected"),
    [
        (120.0, -25.0, "plain"),
        (120.0, -16.5, "plain"),  # louder alone, as somebody who has come nearer
        (152.0, -25.0, "plain"),  # higher alone, as a child
        (152.0, -17.5, "plain"),
        (149.0, -16.5, "plain"),
        (152.0, -16.5, "raised"),
        (120.0, -33.5, "soft"),
        (110.0, -33.5, "soft"),
        (152.0, -33.5, "plain"),
        (120.0, -32.5, "plain"),
    ],
)
def test_a_tone_is_told_beside_what_is_usual(pitch: float, loudness: float, expected: str) -> None:
    voice = ToneOfVoice()
    assert [voice.take(tone(120.0, -25.0)) for _ in range(3)] == ["plain"] * 3
    assert voice.take(tone(pitch, loudness)) == expected


def test_the_first_words_have_no_tone() -> None:
    voice = ToneOfVoice()
    voice.take(tone(120.0, -40.0))
    voice.take(tone(120.0, -40.0))
    assert voice.take(tone(240.0, -10.0)) == "plain"


def test_noise_is_never_raised() -> None:
    voice = ToneOfVoice()
    for _ in range(4):
        voice.take(tone(120.0, -40.0))
    noise = np.random.default_rng(0).normal(0, 6000, 16_000).astype(np.int16).tobytes()
    assert voice.take(noise) == "plain"


def test_words_are_weighed_and_nothing_is_felt_without_them() -> None:
    glad, plain = hear("I am so happy today"), hear("The door is open")
    assert coloured(glad, "plain") == glad
    assert (coloured(glad, "raised").feeling, coloured(glad, "raised").strength) == (
        "thrill", glad.strength,
    )  # fmt: skip
    assert "a raised voice" in coloured(glad, "raised").reason
    assert coloured(glad, "soft").strength == pytest.approx(0.7 * glad.strength)
    assert coloured(hear("That is disgusting"), "raised").feeling == "anger"
    assert coloured(hear("I am so sad"), "raised") == hear("I am so sad")
    for tone_ in ("raised", "soft"):
        assert coloured(plain, tone_) == plain  # type: ignore[arg-type]


def test_it_goes_through_the_interface(server: Server) -> None:
    with miburi.connect(server.url) as partner:
        assert partner.say("I am so happy today", tone="raised").feeling == "thrill"
        assert partner.say("The door is open.", tone="raised").felt == []
    wrong = {"text": "I am happy", "tone": "screaming"}
    assert post(server.url + "/api/v1/say", json=wrong).status_code == 422


def flite(text: str, pitch: float, volume: float) -> bytes:
    said = np.frombuffer(speak(text, "slt", int_f0_target_mean=pitch), np.int16)
    return (volume * said).astype(np.int16).tobytes()


@recognising
@pytest.mark.parametrize("pitch", [150, 280])
def test_a_real_synthesizer_has_the_pitch_that_it_was_told(pitch: float) -> None:
    voice = measure_prosody(flite("i am so happy today", pitch, 1.0))
    assert voice is not None
    assert voice.pitch == pytest.approx(pitch, rel=0.03)


@recognising
def test_a_real_synthesizer_raises_its_voice() -> None:
    voice = ToneOfVoice()
    for text in ("i am at home", "this is a box", "we had some soup"):
        assert voice.take(flite(text, 180, 0.25)) == "plain"
    assert voice.take(flite("i am so happy today", 250, 1.0)) == "raised"
    assert voice.take(flite("i am so happy today", 150, 0.05)) == "soft"
    assert voice.take(flite("i am so happy today", 180, 1.0)) == "plain"
