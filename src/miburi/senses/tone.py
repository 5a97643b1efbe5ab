"""How something was said: in a raised voice, softly, or plainly.

It takes the sound of one utterance after another, and gives the tone of each by comparing its
loudness and pitch with what is usual. The tone only modifies the impression of the words, as
``tone.toml`` says.
"""

import tomllib
from collections import deque
from dataclasses import replace
from functools import cache
from importlib import resources
from statistics import median
from typing import Annotated, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from miburi.feelings.catalogue import FeelingName
from miburi.feelings.temperament import Share
from miburi.ground.tables import Table
from miburi.senses.impression import Brought, Impression

Tone = Literal["plain", "raised", "soft"]
#: The reason that is shown if a raised voice changed the feeling; pages translate it.
RAISED = "a raised voice"

_RATE = 16_000
#: The length of a window (40 ms), and the step from one window to the next, in samples.
_WINDOW, _HOP = 640, 320
#: A window counts as speech if it is at most this many dB below the loudest window.
_RANGE = 25.0
#: The range of a voice's pitch, in Hz, and how alike two periods of a voiced sound must be (1: the
#: same).
_LOWEST, _HIGHEST, _ALIKE = 70.0, 400.0, 0.5
_NEARLY = 0.9
#: How many past utterances define what is usual.
_USUAL = 20


class Tones(Table):
    """The numbers in ``tone.toml``, which says what each does."""

    before: Annotated[int, Field(ge=1, le=_USUAL)]
    louder: Annotated[float, Field(gt=0, le=60)]
    higher: Annotated[float, Field(gt=1, le=4)]
    softer: Annotated[float, Field(gt=0, le=60)]
    soft: Share
    raised: dict[FeelingName, FeelingName]


class Prosody(NamedTuple):
    """Loudness in dB relative to full scale; pitch in Hz, or None if nothing is voiced."""

    loudness: float
    pitch: float | None


@cache
def tones() -> Tones:
    """Return the numbers in ``tone.toml``, which is read once."""
    text = (resources.files(__package__) / "tone.toml").read_text(encoding="utf-8")
    return Tones.model_validate(tomllib.loads(text))


def coloured(heard: Impression, tone: Tone) -> Impression:
    """Return an impression changed by the tone of voice; unchanged if it has no feeling."""
    if heard.feeling is None or tone == "plain":
        return heard
    if tone == "soft":
        return replace(heard, strength=heard.strength * tones().soft)
    feeling = tones().raised.get(heard.feeling, heard.feeling)
    if feeling == heard.feeling:
        return heard
    return replace(heard, feeling=feeling, why=(*heard.why, Brought(RAISED, 1.0)))


def measure_prosody(sound: bytes) -> Prosody | None:
    """Return the loudness and pitch of an utterance, or None if it is silent.

    ``sound`` holds 16-bit samples, 16 kHz, mono.
    """
    samples = np.frombuffer(sound[: len(sound) // 2 * 2], np.int16) / 32_768
    if len(samples) < _WINDOW:
        return None
    windows = np.lib.stride_tricks.sliding_window_view(samples, _WINDOW)[::_HOP]
    windows = windows - windows.mean(axis=1, keepdims=True)
    power = (windows**2).mean(axis=1)
    if power.max() < 1e-10:
        return None
    spoken = power > power.max() * 10 ** (-_RANGE / 10)
    pitches = [pitch for window in windows[spoken] if (pitch := _pitch(window)) is not None]
    loudness = float(10 * np.log10(power[spoken].mean()))
    return Prosody(loudness, median(pitches) if pitches else None)


def _pitch(window: NDArray[np.float64]) -> float | None:
    spectrum = np.fft.rfft(window, 2 * _WINDOW)
    alike = np.fft.irfft(np.abs(spectrum) ** 2)[:_WINDOW]
    alike = alike / alike[0] * _WINDOW / np.arange(_WINDOW, 0, -1)  # fewer samples overlap
    first, last = int(_RATE / _HIGHEST), int(_RATE / _LOWEST)
    near = alike[first : last + 1]
    if near.max() <= _ALIKE:
        return None
    place = int(np.argmax(near >= _NEARLY * near.max()))  # two periods fit as well as one
    while place + 1 < len(near) and near[place + 1] > near[place]:
        place += 1
    return _RATE / (first + place)


class ToneOfVoice:
    """Compares each utterance with earlier ones; it keeps their loudness and pitch, no sound."""

    def __init__(self) -> None:
        self._before: deque[Prosody] = deque(maxlen=_USUAL)

    def take(self, sound: bytes) -> Tone:
        """Return the tone of the next utterance; the first few are plain."""
        voice, numbers = measure_prosody(sound), tones()
        if voice is None:
            return "plain"
        before = [*self._before]
        self._before.append(voice)
        pitches = [one.pitch for one in before if one.pitch is not None]
        if len(before) < numbers.before or voice.pitch is None or not pitches:
            return "plain"
        louder = voice.loudness - median(one.loudness for one in before)
        higher = voice.pitch / median(pitches)
        if louder >= numbers.louder and higher >= numbers.higher:
            return "raised"
        return "soft" if louder <= -numbers.softer and higher <= 1.0 + 1e-9 else "plain"
