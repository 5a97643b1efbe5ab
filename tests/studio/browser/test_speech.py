"""Push to talk in a real browser: words are written down on the device itself, or not at all."""

import pytest
from playwright.sync_api import BrowserContext, Page, expect
from tests.fixtures.browser import needs_browser, until

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


def face(context: BrowserContext, url: str, script: str) -> Page:
    page = context.new_page()
    page.add_init_script(script)
    page.goto(url + "/face")
    page.wait_for_function("document.documentElement.dataset.connected === 'true'")
    page.locator(".senses summary").click()
    page.get_by_role("switch", name="Spoken words").click()
    return page


@pytest.mark.parametrize("there", ["available", "downloadable"])
def test_what_is_said_into_a_held_button_is_said_to_it(
    context: BrowserContext, url: str, there: str
) -> None:
    page = face(context, url, RECOGNISER % (there, "true"))
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


@pytest.mark.parametrize(
    "script",
    [
        RECOGNISER % ("unavailable", "true"),
        RECOGNISER % ("downloadable", "false"),
        (RECOGNISER % ("available", "true")).replace(" processLocally(", " elsewhere("),
        (RECOGNISER % ("available", "true")).replace("async available", "async other"),
        "delete window.SpeechRecognition; window.webkitSpeechRecognition = class { start() {} };",
    ],
    ids=["none", "not installed", "no promise", "older", "webkit"],
)
def test_no_voice_goes_to_a_recogniser_elsewhere(
    context: BrowserContext, url: str, script: str
) -> None:
    page = face(context, url, script)
    expect(page.locator(".senses output")).to_contain_text("Others would send your voice away")
    expect(page.get_by_role("switch", name="Spoken words")).not_to_be_checked()
    assert page.locator(".speak").count() == 0
    assert not page.evaluate("window.begun?.length")
