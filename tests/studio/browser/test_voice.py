"""The partner's voice in a real browser: chirps that sound, words that are spoken, a mouth."""

import json
from collections.abc import Iterator

import pytest
from playwright.sync_api import Page, expect
from tests.fixtures.browser import ask, needs_browser, open_studio

from miburi.feelings.catalogue import CATALOGUE

pytestmark = needs_browser

#: A device with two voices: one of its own, and one that sends the words to a server.
TWO_VOICES = """
  window.spoken = [];
  const voice = (name, lang, localService) => ({ name, lang, localService });
  Object.defineProperty(window, "speechSynthesis", { value: {
    getVoices: () => [voice("far", "en-US", false), voice("near", "en-GB", true)],
    cancel() {},
    speak(words) {
      const { text, voice, rate, pitch } = words;
      window.spoken.push({ text, voice: voice.name, rate, pitch });
      words.onstart();
      window.end = () => words.onend();
    },
  } });
  window.SpeechSynthesisUtterance = class { constructor(text) { this.text = text; } };
"""
#: Watches how far the mouth opens, frame by frame, from now on.
WATCH = """() => {
  window.gapes = [];
  const look = () => {
    window.gapes.push(Number(document.body.dataset.gape));
    requestAnimationFrame(look);
  };
  look();
}"""


def wait_for_moves(page: Page, least: float) -> None:
    """Wait until the watched mouth has moved by so much."""
    page.wait_for_function(f"Math.max(...gapes) - Math.min(...gapes) > {least}")


def open_face(page: Page, url: str) -> None:
    page.goto(url + "/face")
    page.wait_for_function("document.documentElement.dataset.connected === 'true'")


@pytest.fixture
def face(page: Page, url: str) -> Iterator[Page]:
    """The face on a device with two voices, after reloads, too."""
    with page.add_init_script(TWO_VOICES):
        open_face(page, url)
        yield page


def switch(page: Page, name: str = "Voice") -> None:
    if not page.get_by_role("switch", name=name).is_visible():
        page.locator(".senses summary").click()
    page.get_by_role("switch", name=name).click()


def test_it_is_silent_until_it_is_switched_on_then_speaks_with_a_voice_of_the_device(
    face: Page,
) -> None:
    """It moves its mouth, too. It does not repeat earlier sentences."""
    ask(face, "/speak", text="Does nobody hear me?")
    expect(face.locator("#spoken")).to_have_text("Does nobody hear me?")
    loaded = face.evaluate("performance.getEntriesByType('resource').map((one) => one.name)")
    assert any(name.endswith("/senses.js") for name in loaded)
    assert not any(name.endswith("/voice.js") for name in loaded)
    switch(face)
    expect(face.locator("html")).to_have_attribute("data-voice", "on")
    ask(face, "/stimulus", feeling="sadness", strength=1.0)
    face.wait_for_function("document.querySelector('#now').textContent === 'sadness'")
    ask(face, "/speak", text="My arms are heavy today.")
    face.wait_for_function("window.spoken.length")
    face.evaluate(WATCH)
    wait_for_moves(face, 8)
    sad = next(feeling.voice for feeling in CATALOGUE.feeling if feeling.name == "sadness")
    assert face.evaluate("window.spoken") == [{
        "text": "My arms are heavy today.", "voice": "near", "rate": sad.rate, "pitch": sad.pitch,
    }]  # fmt: skip
    expect(face.locator("#spoken")).to_have_text("My arms are heavy today.")
    face.evaluate("window.end()")
    face.wait_for_function("Number(document.body.dataset.gape) < 1")


def test_a_feeling_sounds_where_no_voice_is_installed(page: Page, url: str) -> None:
    """Debian's Chromium has none: what moves the mouth here is sound that was measured."""
    open_face(page, url)
    switch(page)
    expect(page.locator("html")).to_have_attribute("data-voice", "on")
    assert page.evaluate("speechSynthesis.getVoices().length") == 0
    page.evaluate(WATCH)
    ask(page, "/speak", text="今日は")
    wait_for_moves(page, 5)


@pytest.mark.proof(
    "test_it_is_silent_until_it_is_switched_on_then_speaks_with_a_voice_of_the_device"
)
def test_its_mouth_shuts_though_the_device_never_says_that_it_has_ended(face: Page) -> None:
    """Some phones do not; its ears would be closed for ever."""
    face.evaluate(
        """async () => {
          const { lips } = await import("/static/face.js");
          window.opening = () => lips.open(performance.now());
          speechSynthesis.speak = (words) => {
            words.onstart();
            setTimeout(() => (window.opened = window.opening()), 500);  // the chirp is over
          };
        }"""
    )
    switch(face)
    expect(face.locator("html")).to_have_attribute("data-voice", "on")
    ask(face, "/speak", text="Ah.")
    face.wait_for_function("window.opened !== undefined")
    assert face.evaluate("window.opened") is not None
    face.wait_for_function("window.opening() === null")


def test_a_reload_remembers_it_and_waits_for_a_touch(face: Page) -> None:
    switch(face)
    expect(face.locator("html")).to_have_attribute("data-voice", "on")
    face.reload()
    face.wait_for_function("document.documentElement.dataset.connected === 'true'")
    face.locator(".senses summary").focus()
    face.keyboard.press("Enter")
    expect(face.locator("html")).to_have_attribute("data-voice", "on")
    box = face.get_by_role("switch", name="Voice")
    expect(box).to_be_checked()
    box.focus()
    face.keyboard.press("Space")
    expect(face.locator("html")).to_have_attribute("data-voice", "off")
    ask(face, "/speak", text="I am muted.")
    expect(face.locator("#spoken")).to_have_text("I am muted.")
    assert face.evaluate("window.spoken") == []
    face.reload()
    face.locator(".senses summary").click()
    expect(face.get_by_role("switch", name="Voice")).not_to_be_checked()
    expect(face.locator("html")).not_to_have_attribute("data-voice", "on")


def test_the_studio_has_a_voice_too_and_the_answer_is_spoken(page: Page, url: str) -> None:
    with page.add_init_script(TWO_VOICES):
        open_studio(page, url)
    switch(page)
    expect(page.locator("html")).to_have_attribute("data-voice", "on")
    line = page.get_by_label("Say something to it")
    line.fill("I am so sad today")
    line.press("Enter")
    page.wait_for_function("window.spoken.length")
    said = page.evaluate("window.spoken[0].text")
    expect(page.locator(".talk output")).to_contain_text(f"“{said}”")


def test_every_chirp_sounds_as_its_notes_say(workbench: Page) -> None:
    """Rendered by the browser, measured here by counting where the wave crosses zero."""
    chirps = {feeling.name: feeling.voice.chirp for feeling in CATALOGUE.feeling}
    sounds = workbench.evaluate(
        """async (chirps) => {
          const { playChirp } = await import("/static/voice.js"), sounds = {};
          for (const [name, notes] of Object.entries(chirps)) {
            const context = new OfflineAudioContext(1, 88200, 44100);
            const end = playChirp(context, context.destination, notes, 0.1);
            const wave = (await context.startRendering()).getChannelData(0);
            const part = (...ends) => wave.subarray(...ends.map((t) => Math.round(44100 * t)));
            const crossings = (of) => of.reduce((n, x, i) => n + (of[i - 1] < 0 && x >= 0), 0);
            let at = 0.1;
            sounds[name] = {
              pitches: notes.map(([_, length]) => {
                const middle = [at + 0.4 * length, at + 0.85 * length];
                at += length;
                return crossings(part(...middle)) / (middle[1] - middle[0]);
              }),
              loudest: Math.max(...wave.map(Math.abs)),
              after: Math.max(...part(end, 2).map(Math.abs)),
            };
          }
          return sounds;
        }""",
        json.loads(json.dumps(chirps)),
    )
    assert sounds.keys() == chirps.keys()
    for name, sound in sounds.items():
        for heard, (pitch, length) in zip(sound["pitches"], chirps[name], strict=True):
            assert abs(heard - pitch) < 1.5 / (0.45 * length), name
        assert 0.1 < sound["loudest"] < 0.3
        assert sound["after"] < 1e-3
    first_last = {name: (s["pitches"][0], s["pitches"][-1]) for name, s in sounds.items()}
    assert first_last["thrill"][1] > 2 * first_last["thrill"][0]
    assert first_last["sadness"][1] < 0.8 * first_last["sadness"][0]
