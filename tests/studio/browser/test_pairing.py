"""A device that nobody knows yet: it is led to the pairing page, and from there to its wish."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect
from tests.fixtures.browser import (
    look_over,
    needs_browser,
    partner,
    press_above,
    visiting,
)
from tests.fixtures.live import address

from miburi.serving.keys import Keys

pytestmark = needs_browser

WORDS = {
    "en": ("Pair this device", "This is not this partner's token"),
    "ja": ("この端末を登録する", "このロボットのトークンではありません"),
}


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Keys]]:
    """A partner that other devices reach: its address and its keys."""
    folder: Path = tmp_path_factory.mktemp("guarded")
    with partner(folder, "--forget", "--host", "0.0.0.0") as said:
        yield address(said), Keys(folder)


@pytest.mark.parametrize(
    "language",
    [
        "en",
        pytest.param(
            "ja", marks=pytest.mark.proof("test_what_it_knows_is_seen_corrected_and_deleted")
        ),
    ],
)
def test_an_unknown_browser_is_led_to_pairing_and_then_to_the_page_it_wanted(
    browser: Browser, guarded: tuple[str, Keys], language: str
) -> None:
    url, keys = guarded
    pair, wrong = WORDS[language]
    with visiting(browser, locale=language) as context:
        page = context.new_page()
        page.goto(url + "/face")
        page.wait_for_url("**/pair#/face")
        found = look_over(page, "pairing")
        page.get_by_role("textbox").fill("nonsense")
        page.get_by_role("button", name=pair).click()
        expect(page.get_by_role("status")).to_contain_text(wrong)
        page.get_by_role("textbox").fill(keys.token)
        page.get_by_role("button", name=pair).click()
        page.wait_for_url("**/face")
        page.wait_for_function("document.documentElement.dataset.connected === 'true'")
        if language == "en":
            page.goto(url)
            page.wait_for_function("window.did_handshake")
            press_above(page, "Face")
            expect(page.locator(".q-dialog .qr")).to_be_visible()
            found += look_over(page, "the dialog with codes")
        keys.forget()  # as `miburi devices forget --all` does: it must be paired again
        page.wait_for_url("**/pair#/*")
    assert found == []
