"""A voice of the partner's computer in a browser: pages play it, mute it, and go without it."""

import os
import shutil
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, expect
from tests.fixtures.browser import Home, ask, needs_browser, visiting
from tests.fixtures.live import serving
from tests.studio.browser.test_voice import TWO_VOICES, open_face, switch

from miburi.doors.doors import Doors
from miburi.serving.reach import Reach
from miburi.studio.app import make_app
from miburi.talk.synthesizer import find_synthesizer

pytestmark = [
    needs_browser,
    pytest.mark.skipif(
        os.environ.get("CI") != "true" and shutil.which("flite") is None,
        reason="this needs flite (Debian: apt install flite)",
    ),
]
SENTENCE = "I am glad that you came to see me today, my dear old friend. How are you?"
#: Whether the partner speaks, by which its ears close.
SPEAKS = """async () => {
  const { lips } = await import("/static/face.js");
  return lips.open(performance.now()) !== null;
}"""


@pytest.fixture(scope="module")
def voiced(home: Home) -> Iterator[str]:
    """The pages of a partner whose computer has a voice."""
    doors = Doors(voice=find_synthesizer("flite"))
    with serving(make_app(home.runner, Reach(), doors), lifespan=True) as url:
        yield url


@pytest.fixture
def face(browser: Browser, voiced: str) -> Iterator[Page]:
    with visiting(browser) as context:
        context.add_init_script(TWO_VOICES)
        page = context.new_page()
        open_face(page, voiced)
        switch(page)
        expect(page.locator("html")).to_have_attribute("data-voice", "on")
        yield page


def speak(page: Page, text: str) -> None:
    with page.expect_response("**/api/v1/voice/*") as answer:
        ask(page, "/speak", text=text)
    assert answer.value.status == 200


@pytest.mark.proof("test_without_its_sound_the_device_speaks")
def test_a_page_plays_it_with_its_mouth_and_shuts_it_when_somebody_talks_or_mutes_it(
    face: Page,
) -> None:
    """Its ears are closed as long as its mouth is open."""
    speak(face, SENTENCE)
    face.wait_for_timeout(1700)  # the longest chirp is over
    gapes = face.evaluate(
        """async () => {
          const { lips } = await import("/static/face.js"), gapes = [];
          for (let i = 0; i < 12; i++) {
            gapes.push(lips.open(performance.now()));
            await new Promise((done) => setTimeout(done, 60));
          }
          return gapes;
        }"""
    )
    assert None not in gapes
    assert max(gapes) - min(gapes) > 0.3
    assert face.evaluate("window.spoken") == [], "the device's own voice is silent"
    face.evaluate("dispatchEvent(new Event('hush'))")  # as push to talk does
    assert not face.evaluate(SPEAKS)
    speak(face, SENTENCE)
    face.wait_for_timeout(1700)
    assert face.evaluate(SPEAKS)
    switch(face)  # in the middle of a word
    expect(face.locator("html")).to_have_attribute("data-voice", "off")
    assert not face.evaluate(SPEAKS)
    ask(face, "/speak", text="I am muted.")
    expect(face.locator("#spoken")).to_have_text("I am muted.")
    face.wait_for_timeout(300)
    assert not face.evaluate(SPEAKS)


def test_without_its_sound_the_device_speaks(face: Page) -> None:
    face.route("**/api/v1/voice/*", lambda route: route.fulfill(status=200, body="no sound"))
    ask(face, "/speak", text="Hello.")
    face.wait_for_function("window.spoken.length")
    assert face.evaluate("window.spoken[0].text") == "Hello."
