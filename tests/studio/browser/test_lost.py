"""When the server is gone: one clear state, and a Stop that does not pretend."""

import re
from pathlib import Path

from playwright.sync_api import Browser, Page, expect
from tests.fixtures.browser import needs_browser, open_studio, partner, until, visiting
from tests.fixtures.live import address

pytestmark = needs_browser

ALIVE, ALONE = re.compile("静止|動作中|戻り中"), "停止が届きません"
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
    """The studio in Japanese, and the face in English."""
    with (
        visiting(browser, locale="en") as english,
        visiting(browser, locale="ja") as japanese,
    ):
        studio, face = japanese.new_page(), english.new_page()
        with partner(tmp_path, "--forget") as said:
            url = address(said)
            open_studio(studio, url)
            until(studio, lambda now: now["phase"] != "stopped")
            expect(studio.locator(".pill")).to_have_text(ALIVE)
            face.goto(url + "/face")
            expect(face.get_by_role("button", name="Stop", exact=True)).to_be_visible()
        expect(face.get_by_role("button", name=NO_STOP["en"])).to_be_visible()
        expect(face.get_by_role("alert")).to_contain_text("Stop cannot reach it")
        expect(studio.get_by_role("alert").filter(has_text=ALONE)).to_be_visible()
        studio.wait_for_timeout(2500)  # NiceGUI's own message would have come
        expect(studio.locator(".studio")).to_have_attribute("inert", "")  # no face, no Say
        text = shown(studio)
        assert not ALIVE.search(text)
        assert text.count(ALONE) == 1
        assert not re.search("[Cc]onnection lost|[Rr]econnect", text)
        studio.get_by_role("button", name=NO_STOP["ja"]).click()
        expect(studio.locator(".unsent")).to_be_visible()
        with partner(tmp_path, "--forget", "--port", url.rsplit(":", 1)[1]):
            until(studio, lambda now: now["stop"] and now["held"])  # whatever else had stopped it
            expect(studio.locator(".stop-button .reached")).to_be_visible()
            expect(studio.locator(".unsent")).to_be_hidden()
            expect(studio.locator(".studio")).not_to_have_attribute("inert", "")


def test_a_connection_that_hangs_as_it_opens_is_begun_anew(browser: Browser, url: str) -> None:
    with visiting(browser) as visitor:
        visitor.add_init_script(HANGS)
        page = visitor.new_page()
        page.clock.install()
        page.goto(url + "/face")
        page.wait_for_function("window.hung")
        page.clock.run_for(30_000)
        page.wait_for_function("document.documentElement.dataset.connected === 'true'")
