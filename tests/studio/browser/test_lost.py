"""When the server is gone: one clear state, and a Stop that does not pretend."""

import re
from pathlib import Path

from playwright.sync_api import Browser, Page, expect
from tests.fixtures.browser import needs_browser, open_studio, partner, until, visiting
from tests.fixtures.live import address

pytestmark = needs_browser

ALIVE = {"en": re.compile("At rest|Moving|Going back"), "ja": re.compile("静止|動作中|戻り中")}
ALONE = {"en": "Stop cannot reach it", "ja": "停止が届きません"}
NO_STOP = {"en": "Stop: no connection", "ja": "停止（接続なし）"}


#: A first connection that hangs as it opens, as with a computer that is too busy to answer.
HANGS = """window.WebSocket = new Proxy(WebSocket, { construct(real, given) {
  if (!String(given[0]).includes("/live") || window.hung) return Reflect.construct(real, given);
  const close = () => window.hung.onclose({ reason: "" });
  window.hung = { readyState: WebSocket.CONNECTING, close };
  return window.hung;
} });"""


def shown(page: Page) -> str:
    """All text that somebody sees on a page."""
    text = page.evaluate("document.body.innerText")
    assert isinstance(text, str)
    return text


def test_the_pages_say_once_that_stop_reaches_nobody_and_send_it_later(
    browser: Browser, tmp_path: Path
) -> None:
    """The studio in two languages, and the face."""
    with (
        visiting(browser, locale="en") as english,
        visiting(browser, locale="ja") as japanese,
    ):
        studios = {"en": english.new_page(), "ja": japanese.new_page()}
        face = english.new_page()
        with partner(tmp_path, "--forget") as said:
            url = address(said)
            for language, page in studios.items():
                open_studio(page, url)
                until(page, lambda now: now["phase"] != "stopped")
                expect(page.locator(".pill")).to_have_text(ALIVE[language])
            face.goto(url + "/face")
            expect(face.get_by_role("button", name="Stop", exact=True)).to_be_visible()
        expect(face.get_by_role("button", name=NO_STOP["en"])).to_be_visible()
        expect(face.get_by_role("alert")).to_contain_text("Stop cannot reach it")
        for language, page in studios.items():
            expect(page.get_by_role("alert").filter(has_text=ALONE[language])).to_be_visible()
        page.wait_for_timeout(2500)  # NiceGUI's own message would have come
        for language, page in studios.items():
            expect(page.locator(".studio")).to_have_attribute("inert", "")  # no face, no Say
            text = shown(page)
            assert not ALIVE[language].search(text)
            assert text.count(ALONE[language]) == 1
            assert not re.search("[Cc]onnection lost|[Rr]econnect", text)
            page.get_by_role("button", name=NO_STOP[language]).click()
            expect(page.locator(".unsent")).to_be_visible()
        with partner(tmp_path, "--forget", "--port", url.rsplit(":", 1)[1]):
            until(page, lambda now: now["stop"] and now["held"])  # whatever else had stopped it
            for page in studios.values():
                expect(page.locator(".stop-button .reached")).to_be_visible()
                expect(page.locator(".unsent")).to_be_hidden()
                expect(page.locator(".studio")).not_to_have_attribute("inert", "")


def test_a_connection_that_hangs_as_it_opens_is_begun_anew(browser: Browser, url: str) -> None:
    with visiting(browser) as visitor:
        visitor.add_init_script(HANGS)
        page = visitor.new_page()
        page.clock.install()
        page.goto(url + "/face")
        page.wait_for_function("window.hung")
        page.clock.run_for(30_000)
        page.wait_for_function("document.documentElement.dataset.connected === 'true'")
