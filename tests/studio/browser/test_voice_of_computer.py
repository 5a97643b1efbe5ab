"""A voice of the partner's computer in a browser: pages play it, mute it, and go without it."""

import os
import shutil
from collections.abc import Iterator

import pytest
from playwright.sync_api import BrowserContext, Page, expect
from tests.fixtures.browser import ask, needs_browser
from tests.fixtures.live import address, started
from tests.studio.browser.test_voice import open_face, switch

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
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with started(tmp_path_factory.mktemp("voiced"), "--forget", "--voice", "flite") as said:
        yield address(said)


@pytest.fixture
def face(context: BrowserContext, url: str) -> Page:
    page = open_face(context, url)
    switch(page)
    expect(page.locator("html")).to_have_attribute("data-voice", "on")
    return page


def speak(page: Page, text: str) -> None:
    with page.expect_response("**/api/v1/voice/*") as answer:
        ask(page, "/speak", text=text)
    assert answer.value.status == 200


def test_a_page_plays_it_with_its_mouth_and_its_ears_are_closed_meanwhile(face: Page) -> None:
    speak(face, SENTENCE)
    face.wait_for_timeout(1700)  # the longest chirp is over
    gapes = face.evaluate(
        """async () => {
          const { lips } = await import("/static/face.js"), gapes = [];
          for (let open; (open = lips.open(performance.now())) !== null; gapes.push(open))
            await new Promise((done) => requestAnimationFrame(done));
          return gapes;
        }"""
    )
    assert len(gapes) > 10
    assert max(gapes) - min(gapes) > 0.3
    assert face.evaluate("window.spoken") == [], "the device's own voice is silent"


def test_it_is_muted_in_the_middle_of_a_word(face: Page) -> None:
    speak(face, SENTENCE)
    face.wait_for_timeout(1700)
    assert face.evaluate(SPEAKS)
    switch(face)
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


def test_nobody_talks_into_its_own_words(face: Page) -> None:
    """Push to talk silences it."""
    speak(face, SENTENCE)
    face.wait_for_timeout(1700)
    face.evaluate("dispatchEvent(new Event('hush'))")
    assert not face.evaluate(SPEAKS)
