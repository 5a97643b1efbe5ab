"""A device that nobody knows yet: it is led to the pairing page, and from there to its wish."""

from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect
from tests.fixtures.browser import needs_browser
from tests.fixtures.live import address, started

pytestmark = needs_browser

WORDS = {
    "en": ("Pair this device", "This is not the token"),
    "ja": ("この端末を登録する", "このロボットのトークンではありません"),
}


@pytest.mark.parametrize("language", ["en", "ja"])
def test_an_unknown_browser_is_led_to_pairing_and_then_to_the_page_it_wanted(
    browser: Browser, tmp_path: Path, language: str
) -> None:
    pair, wrong = WORDS[language]
    context = browser.new_context(locale=language)
    page = context.new_page()
    with started(tmp_path, "--forget", "--host", "0.0.0.0") as said:
        url = address(said)
        page.goto(url + "/face")
        page.wait_for_url("**/pair#/face")
        page.get_by_role("textbox").fill("nonsense")
        page.get_by_role("button", name=pair).click()
        expect(page.get_by_role("status")).to_contain_text(wrong)
        page.get_by_role("textbox").fill((tmp_path / "token").read_text().strip())
        page.get_by_role("button", name=pair).click()
        page.wait_for_url("**/face")
        page.wait_for_function("document.documentElement.dataset.connected === 'true'")
        context.close()
