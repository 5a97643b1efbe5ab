"""The partner's ears in a real browser: what startles, what does not, and what leaves the page."""

import base64
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect
from tests.fixtures.browser import fake_media, needs_browser, posts, switch
from tests.fixtures.sounds import KINDS, RATE, claps, write_sound

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


@pytest.mark.proof("test_nothing_of_ears_and_eyes_is_loaded_or_remembered_unless_it_is_on")
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


#: Keeps in window.heard what the page's worklet tells the page.
OVERHEAR = """
  window.heard = [];
  window.AudioWorkletNode = class extends AudioWorkletNode {
    constructor(...all) {
      super(...all);
      this.port.addEventListener("message", ({ data }) => window.heard.push(data));
    }
  };
"""


@pytest.mark.proof("test_nothing_of_ears_and_eyes_is_loaded_or_remembered_unless_it_is_on")
def test_a_clap_frightens_it_but_not_while_it_speaks_itself(
    browser: Browser, url: str, tmp_path: Path
) -> None:
    """Nothing but the clap's strength leaves the page. What it says itself closes its ears.

    The clap comes again every few seconds: a busy computer may open the microphone too late for
    the first.
    """
    clap = claps(np.random.default_rng(1))[round(1.7 * RATE) :]  # it comes at 2.5 s
    write_sound(tmp_path / "clap.wav", clap)
    flag = f"--use-file-for-fake-audio-capture={tmp_path / 'clap.wav'}"
    with fake_media(browser, flag) as page:
        sent = posts(page, "/sense")
        page.add_init_script(OVERHEAR)
        page.goto(url + "/face")
        page.locator(".senses summary").click()
        switch(page, "Ears", "Listening")
        expect(page.locator("#now")).to_have_text("fright")
        switch(page, "Ears", "Listening", on=False)
        assert sent
        for startle in sent:
            assert startle.keys() == {"kind", "clearness"}
            assert startle["kind"] == "startle"
            assert 0.5 <= startle["clearness"] <= 1
        heard = len(sent)
        page.evaluate("import('/static/face.js').then(({ lips }) => { lips.open = () => 0.5; })")
        before = page.evaluate("window.heard.length")
        switch(page, "Ears", "Listening")
        page.wait_for_function(f"window.heard.length > {before}")
        switch(page, "Ears", "Listening", on=False)
        assert len(sent) == heard


def test_a_microphone_that_is_granted_after_it_was_switched_off_stays_off(
    page: Page, url: str
) -> None:
    """Somebody thinks about the browser's question, and changes their mind meanwhile."""
    with page.add_init_script(
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
    ):
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


def test_nothing_of_ears_and_eyes_is_loaded_or_remembered_unless_it_is_on(face: Page) -> None:
    face.locator(".senses summary").click()
    expect(face.get_by_role("switch", name="Eyes")).not_to_be_checked()
    loaded = face.evaluate("performance.getEntriesByType('resource').map((one) => one.name)")
    of_senses = ("ears", "startle", "human", "eyes", "look.js")
    assert not any(part in name for name in loaded for part in of_senses)
    face.get_by_role("switch", name="Ears").click()  # this browser has no microphone
    expect(face.locator(".senses output")).not_to_be_empty()
    expect(face.get_by_role("switch", name="Ears")).not_to_be_checked()
    assert face.evaluate("Object.keys(localStorage)") == []
