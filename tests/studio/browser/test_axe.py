"""Every page against axe-core, the accessibility checker of others: light, dark, laptop, phone.

test_pairing, test_fleet and test_study check the pages that this partner does not have.
"""

import pytest
from playwright.sync_api import Browser, Page, expect
from tests.fixtures.browser import (
    ask,
    look_over,
    needs_browser,
    press_above,
    until,
    visiting,
)
from tests.studio.browser.test_speech import RECOGNISER

pytestmark = needs_browser


@pytest.mark.proof("test_pages_to_read_have_no_violation")
def test_the_studio_has_no_violation_whatever_is_open(studio: Page) -> None:
    studio.locator(".senses summary").click()
    found: list[str] = []
    for tab in ("Contact", "Time", "Gestures", "Body"):
        studio.get_by_role("tab", name=tab).click()
        found += look_over(studio, tab)
    press_above(studio, "Face")
    expect(studio.locator(".q-dialog .card")).to_be_visible()
    found += look_over(studio, "the dialog")
    studio.get_by_role("button", name="Close").click()
    studio.get_by_role("button", name="Reach in").click()
    until(studio, lambda now: now["hand_out"])
    ask(studio, "/stop")
    expect(studio.locator(".why")).to_be_visible()
    found += look_over(studio, "stopped")
    assert "\n".join(found) == ""


@pytest.mark.proof("test_pages_to_read_have_no_violation")
@pytest.mark.parametrize("where", ["/face", "/"])
def test_push_to_talk_and_the_face_have_no_violation(page: Page, url: str, where: str) -> None:
    """Before somebody speaks, meanwhile, and with an answer; awake and stopped."""
    with page.add_init_script(RECOGNISER % ("available", "true")):
        page.goto(url + where)
    page.wait_for_function("document.documentElement.dataset.connected === 'true'")
    page.locator(".senses summary").click()
    page.get_by_role("switch", name="Spoken words").click()
    found = look_over(page, "with its senses")
    if where == "/face":
        page.locator(".senses summary").click()
        page.get_by_text("Say something", exact=True).click()
        expect(page.locator("input[name=text]")).to_be_focused()
    speak = page.get_by_role("button", name="Hold and speak")
    speak.focus()
    found += look_over(page, "ready")
    page.keyboard.press("Enter")
    listening = page.get_by_role("button", name="Listening")
    expect(listening).to_have_attribute("aria-pressed", "true")
    found += look_over(page, "listening")
    page.keyboard.press("Enter")
    expect(page.locator(".talk output")).to_contain_text("sadness")
    found += look_over(page, "answered")
    if where == "/face":
        ask(page, "/stop")
        expect(page.locator("#release")).to_be_visible()
        found += look_over(page, "stopped")
    assert "\n".join(found) == ""


def test_pages_to_read_have_no_violation(browser: Browser, url: str) -> None:
    found = []
    with visiting(browser) as context:
        page = context.new_page()
        for where, language in (("/privacy", "en"), ("/privacy", "ja"), ("/mistyped", "fr")):
            page.goto(f"{url}{where}?lang={language}")
            found += look_over(page, f"{where} in {language}")
    assert "\n".join(found) == ""
