"""Push to talk in a real browser: words are written down on the device itself, or not at all."""

import base64

import numpy as np
import pytest
from playwright.sync_api import Page, expect
from tests.fixtures.browser import needs_browser, until

from miburi.senses.tone import ToneOfVoice, measure_prosody, tones

pytestmark = needs_browser

#: A recogniser that hears a sad sentence; it keeps what it was asked.
RECOGNISER = """
  window.begun = []; window.asked = [];
  window.SpeechRecognition = class {
    static async available(wish) { window.asked.push(["available", wish]); return "%s"; }
    static async install(wish) { window.asked.push(["install", wish]); return %s; }
    get processLocally() { return this.local; }
    set processLocally(local) { this.local = local; }
    start() { window.begun.push([this.lang, this.local]); }
    stop() {
      this.onresult({ results: [[{ transcript: "i am so sad today" }]] });
      this.onend();
    }
    abort() { this.onend(); }
  };
"""


def listen(page: Page, url: str, script: str) -> None:
    """Open the face in a browser with a recogniser, and switch spoken words on."""
    with page.add_init_script(script):
        page.goto(url + "/face")
    page.wait_for_function("document.documentElement.dataset.connected === 'true'")
    page.locator(".senses summary").click()
    page.get_by_role("switch", name="Spoken words").click()


DOWNLOADABLE = pytest.param(
    "downloadable", marks=pytest.mark.proof("test_no_voice_goes_to_a_recogniser_elsewhere")
)


@pytest.mark.parametrize("there", ["available", DOWNLOADABLE])
def test_what_is_said_into_a_held_button_is_said_to_it(page: Page, url: str, there: str) -> None:
    listen(page, url, RECOGNISER % (there, "true"))
    expect(page.locator("html")).to_have_attribute("data-speech", "on")
    page.locator(".senses summary").click()
    page.get_by_text("Say something", exact=True).click()
    page.get_by_role("button", name="Hold and speak").dispatch_event("pointerdown")
    button = page.get_by_role("button", name="Listening")
    expect(button).to_have_attribute("aria-pressed", "true")
    page.wait_for_timeout(500)  # so long is held, and not pressed
    button.dispatch_event("pointerup")
    expect(page.locator(".talk output")).to_contain_text("I heard sadness in “sad”")
    until(page, lambda now: now["emotion"][1] > 0.1)
    expect(page.get_by_role("button", name="Hold and speak")).to_be_visible()
    assert page.evaluate("begun") == [["en-US", True]]
    wish = {"langs": ["en-US"], "processLocally": True}
    installed = [["install", wish]] if there == "downloadable" else []
    assert page.evaluate("asked") == [["available", wish], *installed]


#: Recognisers that would send a voice elsewhere.
ELSEWHERE = {
    "none": RECOGNISER % ("unavailable", "true"),
    "not installed": RECOGNISER % ("downloadable", "false"),
    "no promise": (RECOGNISER % ("available", "true")).replace(" processLocally(", " elsewhere("),
    "older": (RECOGNISER % ("available", "true")).replace("async available", "async other"),
    "webkit": "delete window.SpeechRecognition;"
    "window.webkitSpeechRecognition = class { start() {} };",
}


def test_no_voice_goes_to_a_recogniser_elsewhere(face: Page) -> None:
    face.locator(".senses summary").click()
    reason, box = face.locator(".senses output"), face.get_by_role("switch", name="Spoken words")
    for name, script in ELSEWHERE.items():
        face.evaluate(f"() => {{ {script} }}")
        face.evaluate("() => { document.querySelector('.senses output').textContent = '' }")
        box.click()
        expect(reason, name).to_contain_text("would send your voice to a company")
        expect(box, name).not_to_be_checked()
        assert face.locator(".speak").count() == 0, name
        assert not face.evaluate("window.begun?.length"), name


#: A microphone into which a voice of straw speaks, at window.voice's pitch, Hz, and loudness.
MICROPHONE = """
  window.voice = [120, 0.02];
  navigator.mediaDevices.getUserMedia = async ({ audio }) => {
    if (audio.autoGainControl !== false) throw new Error("its loudness means nothing");
    const context = new AudioContext(), to = context.createMediaStreamDestination();
    const wave = context.createOscillator(), gain = context.createGain();
    wave.type = "sawtooth";
    [wave.frequency.value, gain.gain.value] = window.voice;
    wave.connect(gain).connect(to);
    wave.start();
    return to.stream;
  };
"""
SAY = """(sentence) => {
  SpeechRecognition.prototype.stop = function () {
    this.onresult({ results: [[{ transcript: sentence }]] });
    this.onend();
  };
}"""


@pytest.mark.proof("test_what_is_said_into_a_held_button_is_said_to_it")
def test_a_raised_voice_weighs_what_the_words_say(page: Page, url: str) -> None:
    listen(page, url, RECOGNISER % ("available", "true") + MICROPHONE)
    page.locator(".senses summary").click()
    page.get_by_text("Say something", exact=True).click()
    sent: list[object] = []
    page.on("request", lambda r: r.url.endswith("/say") and sent.append(r.post_data_json))

    def say(sentence: str) -> None:
        page.evaluate(SAY, sentence)
        page.get_by_role("button", name="Hold and speak").dispatch_event("pointerdown")
        page.wait_for_timeout(1200)  # so long it is measured
        with page.expect_response("**/say"):
            page.get_by_role("button", name="Listening").dispatch_event("pointerup")

    for _ in range(tones().before):
        say("the door is open")
    page.evaluate("window.voice = [180, 0.2]")
    say("the door is open")
    page.wait_for_function("!document.querySelector('.talk output').textContent.includes('…')")
    expect(page.locator(".talk output")).to_contain_text("No feeling heard")
    say("i am so happy today")
    expect(page.locator(".talk output")).to_contain_text("I heard thrill in")
    expect(page.locator(".talk output")).to_contain_text("a raised voice")
    plain = [{"text": "the door is open", "tone": "plain", "language": "en"}] * tones().before
    assert sent == [
        *plain,
        {"text": "the door is open", "tone": "raised", "language": "en"},
        {"text": "i am so happy today", "tone": "raised", "language": "en"},
    ]


def voice(pitch: float, loudness: float) -> bytes:
    """A second of a voice of straw, as loud as so many dB below full scale."""
    time = np.arange(16_000) / 16_000
    wave = np.sum([np.sin(2 * np.pi * pitch * n * time) / n for n in range(1, 11)], axis=0)
    wave = wave / np.sqrt(np.mean(wave**2)) * 10 ** (loudness / 20)
    return (32_767 * wave).clip(-32_767, 32_767).astype("<i2").tobytes()


def test_the_page_measures_and_judges_as_the_computer_does(workbench: Page) -> None:
    said = [(120.0, -25.0)] * 3
    said += [(120.0, -12.0), (205.0, -25.0), (190.0, -12.0), (110.0, -40.0), (330.0, -16.0)]
    sounds = [voice(*each) for each in said] + [bytes(32_000)]
    here = ToneOfVoice()
    expected = [(measure_prosody(sound), here.take(sound)) for sound in sounds]
    found = workbench.evaluate(
        """async ([sounds, tones]) => {
          const { Prosody, summary, judge } = await import("/static/tone.js"), before = [];
          return sounds.map((data) => {
            const bytes = Uint8Array.from(atob(data), (one) => one.charCodeAt(0));
            const samples = Array.from(new Int16Array(bytes.buffer), (one) => one / 32768);
            const windows = new Prosody(16000).take(samples);
            return [summary(windows), judge(windows, before, tones)];
          });
        }""",
        [[base64.b64encode(sound).decode() for sound in sounds], tones().model_dump()],
    )
    assert {tone for _, tone in expected} == {"plain", "raised", "soft"}
    for (prosody, tone), (measured, judged) in zip(expected, found, strict=True):
        assert judged == tone
        if prosody is None:
            assert measured is None
        else:
            assert measured["loudness"] == pytest.approx(prosody.loudness, abs=0.1)
            assert measured["pitch"] == pytest.approx(prosody.pitch, rel=0.01)
