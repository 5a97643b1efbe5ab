"""Spoken words: what is an utterance, which phrase it was, and what was none."""

import subprocess
import sys
import wave
from collections.abc import Iterator
from io import BufferedReader, BytesIO
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from tests.fixtures.live import Server
from tests.fixtures.speech import recognising, speak

from miburi.errors import DescriptionError, InputError
from miburi.senses.utterances import FRAME, LONGEST_UTTERANCE, frames, utterances

FRAME_TIME = 0.032


def cut(pattern: str) -> list[str]:
    """Cut a stretch of frames, a letter each; capital letters are speech."""
    heard = utterances(
        [letter.encode() for letter in pattern], lambda frame: float(frame.isupper())
    )
    return [said.decode() for said in heard]


def test_an_utterance_has_the_quiet_around_it() -> None:
    quiet = "abcdefghijklmnopqrstuvwxyz"
    assert cut(quiet + "HELLO" + quiet) == [quiet[-12:] + "HELLO" + quiet[:19]]


def test_a_breath_does_not_end_an_utterance_and_a_click_is_none() -> None:
    asked = "HOW" + "." * 18 + "ARE" + "." * 19
    assert cut(asked + "YOU") == [asked, "YOU"]
    assert cut("....AA....AA....") == []


def test_who_speaks_on_is_cut_and_nothing_is_lost() -> None:
    pieces = cut("A" * 1000)
    assert "".join(pieces) == "A" * 1000
    assert max(map(len, pieces)) * FRAME_TIME == pytest.approx(LONGEST_UTTERANCE, abs=FRAME_TIME)


def test_where_the_sound_ends_the_utterance_ends() -> None:
    assert cut("..HELLO.") == ["..HELLO."]
    assert cut("") == []


def reader(content: bytes) -> BufferedReader:
    return BufferedReader(BytesIO(content))  # type: ignore[arg-type]


def wav(rate: int = 16_000, width: int = 2, channels: int = 1, samples: int = 1000) -> bytes:
    file = BytesIO()
    with wave.open(file, "wb") as sound:
        sound.setparams((channels, width, rate, 0, "NONE", "not compressed"))
        sound.writeframes(bytes(range(100)) * (samples * width * channels // 100))
    return file.getvalue()


def test_a_file_and_a_pipe_give_the_same_frames() -> None:
    samples = bytes(range(100)) * 20
    assert list(frames(reader(wav()))) == list(frames(reader(samples)))
    assert b"".join(frames(reader(samples))) == samples.ljust(2 * FRAME, b"\0")
    assert list(frames(reader(b""))) == []


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (wav(rate=44_100), "got 44100 Hz"),
        (wav(width=1), "8 bit"),
        (wav(channels=2), "2; `ffmpeg"),
        (b"RIFF", "not a readable WAV"),
        (b"RIFF\0\0\0\0AVI LIST", "not a readable WAV"),
    ],
)
def test_other_sound_is_refused_in_words(content: bytes, words: str) -> None:
    with pytest.raises(InputError, match=words):
        list(frames(reader(content)))


@recognising
@pytest.mark.parametrize(
    "voice", ["slt", pytest.param("rms", marks=pytest.mark.proof("test_phrases_of_ones_own"))]
)
def test_phrases_are_heard_and_others_are_not(voice: str) -> None:
    from miburi.senses.recogniser import PhraseRecogniser, load_phrases

    recogniser = PhraseRecogniser(load_phrases())
    known = ["i am so happy today", "thank you very much", "leave me alone"]
    others = ["the bus to the harbour was late", "seventeen green bottles"]
    heard = [recogniser.recognise(speak(text, voice)) for text in known]
    assert sum(a == b for a, b in zip(heard, known, strict=True)) >= 2
    assert [recogniser.recognise(speak(text, voice)) for text in others] == [None] * 2
    noise = np.random.default_rng(3).normal(0, 300, 32_000).astype(np.int16).tobytes()
    assert recogniser.recognise(noise) is None
    assert recogniser.recognise(b"") is None


@recognising
def test_phrases_of_ones_own(tmp_path: Path) -> None:
    from miburi.senses.recogniser import PhraseRecogniser, load_phrases

    own = tmp_path / "own.toml"
    own.write_text('phrases = ["open the {what}", "{who} good dog"]\n[slots]\n'
                   'what = ["window", "door"]\nwho = ["", "my"]\n')  # fmt: skip
    recogniser = PhraseRecogniser(load_phrases(own))
    for text in ("open the door", "my good dog"):
        assert recogniser.recognise(speak(text, "slt")) == text
    assert recogniser.recognise(speak("i am so happy today", "slt")) is None


@recognising
@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("phrases = []", "phrases"),
        ("phrases = ['']", "phrases"),
        ("phrases = ['hello; public <x> = <x>;']", "phrases"),
        ("phrases = ['Hello']", "phrases"),
        ("phrases = ['hello {who}']", "add it to"),
        ("phrases = ['hello {who']", "add it to"),
        ("phrases = ['hello']\n[slots]\nwho = ['']", "has no words"),
        ("phrases = ['hello']\n[slots]\nwho = ['a | b']", "slots.who"),
        ("phrases = ['hello']\ngrammar = 'x'", "grammar"),
    ],
)
def test_wrong_phrases_are_refused_in_words(tmp_path: Path, text: str, words: str) -> None:
    """What is no phrase is none of the grammar's signs either, and says so."""
    from miburi.senses.recogniser import load_phrases

    own = tmp_path / "own.toml"
    own.write_text(text)
    with pytest.raises(DescriptionError, match=words):
        load_phrases(own)


@recognising
def test_a_word_that_nobody_knows_is_named() -> None:
    from miburi.senses.recogniser import PhraseRecogniser, Phrases

    with pytest.raises(InputError, match="not in .*: xyzzyq"):
        PhraseRecogniser(Phrases(phrases=["hello xyzzyq"]))


@recognising
def test_speech_is_told_from_noise_and_quiet() -> None:
    from miburi.senses.utterances import voice_detector

    quiet = np.random.default_rng(1).normal(0, 30, 16_000).astype(np.int16).tobytes()
    noise = np.random.default_rng(2).normal(0, 3000, 48_000).astype(np.int16).tobytes()
    said = speak("i am so happy today", "slt")
    heard = list(utterances(pieces(quiet + said + quiet + noise + quiet), voice_detector()))
    assert len(heard) == 1
    assert abs(len(heard[0]) - len(said)) < 16_000 * 2


def pieces(sound: bytes) -> Iterator[bytes]:
    edges = range(0, len(sound) + 1, FRAME)
    return (sound[a:b] for a, b in pairwise(edges))


@pytest.mark.proof("test_phrases_of_ones_own")
@recognising
def test_the_command_says_what_it_hears_to_a_live_partner(server: Server) -> None:
    quiet = bytes(40 * FRAME)
    said = [speak(text, "slt") for text in ("i am so sad today", "seventeen green bottles")]
    done = subprocess.run(
        [sys.executable, "-m", "miburi", "listen", "--url", server.url],
        input=quiet.join([b"", *said, b""]), capture_output=True, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, b"")
    first, *felt, last = done.stdout.decode().splitlines()
    assert (first, last) == ("heard: i am so sad today", "heard: nothing that it knows")
    assert felt[1].startswith("it feels sadness")
    assert [e.source for e in server.runner.history.after(0) if e.kind == "stimulus"] == ["speech"]
