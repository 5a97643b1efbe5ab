"""When the server is gone: one clear state, and a Stop that does not pretend."""

import re
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect
from tests.fixtures.browser import needs_browser, release, until, without_3d
from tests.fixtures.live import address, started

pytestmark = needs_browser

ALIVE = {"en": re.compile("At rest|Moving|Going back"), "ja": re.compile("静止|動作中|戻り中")}
ALONE = {"en": "Stop cannot reach it", "ja": "停止が届きません"}
NO_STOP = {"en": "Stop: no connection", "ja": "停止（接続なし）"}


def shown(page: Page) -> str:
    """All text that somebody sees on a page."""
    text = page.evaluate("document.body.innerText")
    assert isinstance(text, str)
    return text


@pytest.mark.parametrize("language", ["en", "ja"])
def test_the_page_says_once_that_stop_reaches_nobody_and_sends_it_later(
    browser: Browser, tmp_path: Path, language: str
) -> None:
    context = browser.new_context(locale=language)
    with started(tmp_path, "--forget") as said:
        url = address(said)
        page = without_3d(context, url)
        # On a busy computer a late loop or server may have stopped it, until somebody releases it.
        until(page, lambda now: now["phase"] != "stopped" or not release(page))
        expect(page.locator(".pill")).to_have_text(ALIVE[language])
    expect(page.get_by_role("alert").filter(has_text=ALONE[language])).to_be_visible()
    page.wait_for_timeout(2500)  # NiceGUI's own message would have come
    text = shown(page)
    assert not ALIVE[language].search(text)
    assert text.count(ALONE[language]) == 1
    assert not re.search("[Cc]onnection lost|[Rr]econnect", text)
    page.get_by_role("button", name=NO_STOP[language]).click()
    expect(page.locator(".unsent")).to_be_visible()
    with started(tmp_path, "--forget", "--port", url.rsplit(":", 1)[1]):
        until(page, lambda now: now["stop"] and now["held"])  # whatever else had stopped it
        expect(page.locator(".stop-button .reached")).to_be_visible()
        expect(page.locator(".unsent")).to_be_hidden()
    context.close()


def test_the_face_says_that_stop_reaches_nobody(browser: Browser, tmp_path: Path) -> None:
    page = browser.new_page()
    with started(tmp_path, "--forget") as said:
        page.goto(address(said) + "/face")
        expect(page.get_by_role("button", name="Stop", exact=True)).to_be_visible()
    expect(page.get_by_role("button", name="Stop: no connection")).to_be_visible()
    expect(page.get_by_role("alert")).to_contain_text("Stop cannot reach it")
    page.close()
