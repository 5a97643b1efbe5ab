"""The partner's ears in a real browser: what startles, what does not, and what leaves the page."""

import base64
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from playwright.sync_api import Browser, BrowserContext, Page, expect
from tests.fixtures.browser import fake_media, needs_browser, switch
from tests.fixtures.sounds import KINDS, RATE, Sound, add, claps, talks, write_sound

pytestmark = needs_browser

#: The strengths that the page's own worklet finds in a recording, played without a clock.
HEAR = """async ([data, rate]) => {
  const bytes = Uint8Array.from(atob(data), (one) => one.charCodeAt(0));
  const samples = new Float32Array(bytes.buffer), strengths = [];
  const context = new OfflineAudioContext(1, samples.length, rate);
  await context.audioWorklet.addModule("/static/startle-worklet.js");
  const sound = context.createBufferSource(), ear = new AudioWorkletNode(context, "startle");
  sound.buffer = context.createBuffer(1, samples.length, rate);
  sound.buffer.copyToChannel(samples, 0);
  ear.port.onmessage = ({ data }) => strengths.push(data);
  sound.connect(ear).connect(context.destination);
  sound.start();
  await context.startRendering();
  await new Promise((done) => setTimeout(done, 20));
  return strengths;
}"""


def test_what_startles_is_told_from_what_does_not_in_28_of_30(workbench: Page) -> None:
    wrong: list[tuple[str, int, list[float]]] = []
    for kind, startles in KINDS.items():
        for seed in range(5):
            sound = kind(np.random.default_rng(seed))
            data = base64.b64encode(sound.astype("<f4").tobytes()).decode()
            strengths = workbench.evaluate(HEAR, [data, RATE])
            assert all(0.5 <= strength <= 1 for strength in strengths)
            if bool(strengths) != startles:
                wrong.append((kind.__name__, seed, strengths))
    assert len(wrong) <= 2, wrong


@contextmanager
def hearing(
    browser: Browser, url: str, folder: Path, sound: Sound
) -> Iterator[tuple[Page, list[dict[str, Any]]]]:
    """A browser into whose microphone a recording goes, once; and all that its page sends."""
    path = folder / "sound.wav"
    write_sound(path, sound)
    flag = f"--use-file-for-fake-audio-capture={path}%noloop"
    with fake_media(browser, url, flag) as (page, sent):
        switch(page, "Ears", "Listening")
        yield page, sent


def test_a_clap_frightens_it_and_nothing_but_its_strength_leaves_the_page(
    browser: Browser, url: str, tmp_path: Path
) -> None:
    clap = claps(np.random.default_rng(1))[round(1.7 * RATE) :]  # it comes at 2.5 s
    with hearing(browser, url, tmp_path, clap) as (page, sent):
        expect(page.locator("#now")).to_have_text("fright")
        assert [one.keys() for one in sent] == [{"kind", "clearness"}]
        assert sent[0]["kind"] == "startle"
        assert 0.5 <= sent[0]["clearness"] <= 1


def test_talk_and_a_clap_while_it_speaks_itself_send_nothing(
    browser: Browser, url: str, tmp_path: Path
) -> None:
    """It hears itself, so its ears are closed then: 2 s of talk; at 4.2 s comes a clap."""
    sound = claps(np.random.default_rng(1))
    add(sound, 0, talks(np.random.default_rng(1))[: 2 * RATE])
    with hearing(browser, url, tmp_path, sound) as (page, sent):
        page.wait_for_timeout(1200)
        assert sent == []
        page.evaluate("import('/static/face.js').then(({ lips }) => { lips.open = () => 0.5; })")
        page.wait_for_timeout(4000)
        switch(page, "Ears", "Listening", on=False)
        assert sent == []


def test_a_microphone_that_is_granted_after_it_was_switched_off_stays_off(
    context: BrowserContext, url: str
) -> None:
    """Somebody thinks about the browser's question, and changes their mind meanwhile."""
    page = context.new_page()
    page.add_init_script(
        """
        window.tracks = [];
        navigator.mediaDevices.getUserMedia = () => new Promise((done) => {
          window.grant = () => {
            const stream = document.createElement("canvas").captureStream();
            window.tracks.push(...stream.getTracks());
            done(stream);
          };
        });
        """
    )
    page.goto(url + "/face")
    page.locator(".senses summary").click()
    box = page.get_by_role("switch", name="Ears")
    box.click()
    page.wait_for_function("!!window.grant")
    box.click()
    page.evaluate("window.grant()")
    page.wait_for_function("window.tracks.length && window.tracks[0].readyState === 'ended'")
    expect(page.locator("html")).to_have_attribute("data-ears", "off")
    expect(box).not_to_be_checked()


def test_no_ear_is_loaded_or_remembered_unless_it_is_on(browser: Browser, url: str) -> None:
    context = browser.new_context(permissions=[])
    page = context.new_page()
    page.goto(url + "/face")
    page.locator(".senses summary").click()
    loaded = page.evaluate("performance.getEntriesByType('resource').map((one) => one.name)")
    assert not any("ears" in name or "startle" in name for name in loaded)
    page.get_by_role("switch", name="Ears").click()  # this browser has no microphone
    expect(page.locator(".senses output")).not_to_be_empty()
    expect(page.get_by_role("switch", name="Ears")).not_to_be_checked()
    assert page.evaluate("Object.keys(localStorage)") == []
    context.close()
