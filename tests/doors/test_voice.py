"""A voice of the partner's computer: what it sounds like, what it refuses, and how it ends."""

import asyncio
import io
import os
import shutil
import wave
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from tests.fixtures.live import interface, serving
from tests.fixtures.waiting import PATIENCE, get, post, until

from miburi.doors.doors import Doors
from miburi.errors import InputError
from miburi.feelings import Stimulus
from miburi.feelings.catalogue import CATALOGUE, Voice
from miburi.languages.rhythm import Rhythm
from miburi.live.runner import Runner
from miburi.live.wishes import Feel, Granted, KeepTime, Speak, Wish
from miburi.talk.synthesizer import Sound, Synthesizer, find_synthesizer

SENTENCE = "I am glad that you came to see me today, my friend."
needs_flite = pytest.mark.skipif(
    os.environ.get("CI") != "true" and shutil.which("flite") is None,
    reason="this needs flite (Debian: apt install flite)",
)


def sound_of(text: str, voice: Voice) -> Sound:
    """Return what flite makes of a sentence."""
    synthesizer = replace(find_synthesizer("flite"), patience=60)  # a busy machine takes its time
    made = asyncio.run(synthesizer.sound(text, voice))
    assert made is not None
    with wave.open(io.BytesIO(made.wave)) as file:
        seconds = file.getnframes() / file.getframerate()
    assert made.rhythm.seconds == pytest.approx(seconds, abs=0.1)
    return made


@needs_flite
def test_a_feeling_is_heard_in_its_voice() -> None:
    glad, sad = (sound_of(SENTENCE, CATALOGUE.voice(name)) for name in ("happiness", "sadness"))
    slower = sad.rhythm.seconds / glad.rhythm.seconds
    assert slower == pytest.approx(1.1 / 0.8, rel=0.1), "sadness is slow"


@needs_flite
@pytest.mark.parametrize("text", ["Don’t “go” — not yet…", "-o /etc/passwd", "café no. 5", "a"])
def test_any_sentence_has_a_sound_of_its_own(text: str) -> None:
    assert 0.2 < sound_of(text, Voice()).rhythm.seconds < 5.0


@needs_flite
def test_what_stands_out_is_known_from_the_sound() -> None:
    text = "I forgot. The garden is about to bloom."
    usual, slow = sound_of(text, Voice()), sound_of(text, Voice(rate=0.5))
    first, *others = usual.rhythm.prominent
    assert len(others) == 2, "garden, bloom"
    assert others[0] - first > 0.5, "a pause stands between the sentences"
    assert np.array(slow.rhythm.prominent) == pytest.approx(2 * np.array([first, *others]), rel=0.1)


def made(folder: Path, script: str) -> Synthesizer:
    """Return what runs a script in flite's place."""
    program = folder / "flite"
    program.write_text(f"#!/bin/sh\n{script}\n", encoding="utf-8")
    program.chmod(0o700)
    return Synthesizer(str(program))


def hanging(folder: Path) -> Synthesizer:
    """Return what never ends by itself, and names its folder while it lives."""
    return made(folder, f"exec tail -f {folder}/flite")


def alive(folder: Path) -> bool:
    for words in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):
            if str(folder) in words.read_text(encoding="utf-8"):
                return True
    return False


@pytest.mark.parametrize("text", ["今日は", "…", "🎉🎉"])
def test_what_it_has_no_words_for_starts_nothing(text: str, tmp_path: Path) -> None:
    assert asyncio.run(made(tmp_path, f"touch {tmp_path}/begun").sound(text, Voice())) is None
    assert not (tmp_path / "begun").exists()


def test_one_that_fails_or_hangs_makes_no_sound_and_is_ended(tmp_path: Path) -> None:
    for script in ("exit 3", "exit 0"):  # it writes no file
        assert asyncio.run(made(tmp_path, script).sound("Hello", Voice())) is None
    assert asyncio.run(replace(hanging(tmp_path), patience=0.3).sound("Hello", Voice())) is None
    assert not alive(tmp_path)


def test_its_words_stand_on_no_command_line(tmp_path: Path) -> None:
    program = made(tmp_path, f'echo "$@" > {tmp_path}/arguments')
    asyncio.run(program.sound("My secret", Voice()))
    assert "secret" not in (tmp_path / "arguments").read_text()


def test_others_and_a_missing_one_are_refused_in_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="must be flite"):
        find_synthesizer("festival")
    monkeypatch.setenv("PATH", "")
    with pytest.raises(InputError, match="sudo apt install flite"):
        find_synthesizer("flite")


@pytest.fixture
def voiced(live: Runner, tmp_path: Path) -> Iterator[tuple[str, Runner, Path]]:
    """The interface of a live partner whose synthesizer counts how often it runs."""
    program = made(
        tmp_path,
        f'echo 1 >> {tmp_path}/runs\nfor last; do :; done\nprintf "RIFFsound" > "$last"',
    )
    app = interface(live)
    Doors(voice=program).open(app, live)
    with serving(app) as url:
        yield url, live, tmp_path


def said(live: Runner, text: str) -> int:
    """Let it say something; return the number by which pages know that."""
    live.ask(Speak(text)).result(PATIENCE)
    live.ask(Feel(Stimulus("happiness", 0.1))).result(PATIENCE)  # a step later pages see it
    spoken = live.snapshot.state.spoken
    assert spoken is not None
    assert spoken.text == text
    return spoken.number


def test_pages_get_the_latest_sentence_made_into_sound_once(
    voiced: tuple[str, Runner, Path],
) -> None:
    url, live, folder = voiced

    def ask(number: int) -> httpx.Response:
        return get(f"{url}/api/v1/voice/{number}")

    assert ask(1).status_code == 404, "it has said nothing yet"
    for text in ("Hello.", "How are you?", "今日は"):
        number = said(live, text)
        answers = [ask(number), ask(number)]
        if text == "今日は":
            assert [each.status_code for each in answers] == [404, 404]
            continue
        for answer in answers:
            assert answer.status_code == 200
            assert answer.headers["content-type"] == "audio/wav"
            assert answer.content == b"RIFFsound"
        assert ask(number - 1).status_code == 404
    assert (folder / "runs").read_text().count("1") == 2


def test_the_sound_tells_the_partner_when_to_beat_once(
    live: Runner, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[Wish[Any]] = []

    def heard(wish: Wish[Granted]) -> Future[Granted]:
        told.append(wish)
        return Runner.ask(live, wish)

    monkeypatch.setattr(live, "ask", heard)
    phones = "pau:0.2 g:0.3 uh:0.5 d:0.6 n:0.7 ay:1.1 t:1.2 pau:1.5"
    script = f'for last; do :; done\nprintf "RIFFsound" > "$last"\necho "{phones}"'
    app = interface(live)
    Doors(voice=made(tmp_path, script)).open(app, live)
    number = said(live, "Good night!")
    told.clear()
    with serving(app) as url:
        for _ in range(2):
            assert get(f"{url}/api/v1/voice/{number}").status_code == 200
    assert told == [KeepTime(number, Rhythm((0.4, 0.9), 1.5))]


def test_a_synthesizer_that_hangs_holds_up_nothing_and_ends_with_the_server(
    live: Runner, tmp_path: Path
) -> None:
    app = interface(live)
    Doors(voice=hanging(tmp_path)).open(app, live)
    number = said(live, "Hello.")
    with ThreadPoolExecutor(1) as pool, serving(app) as url:
        waiting = pool.submit(get, f"{url}/api/v1/voice/{number}")
        until(lambda: alive(tmp_path))
        assert get(f"{url}/api/v1/state").status_code == 200
        assert post(f"{url}/api/v1/stop").status_code == 204
        said(live, "I stand still.")
        assert live.snapshot.state.phase == "stopped"
        assert not waiting.done()
    assert not alive(tmp_path)
    with suppress(httpx.TransportError):  # the server has ended
        waiting.result()
