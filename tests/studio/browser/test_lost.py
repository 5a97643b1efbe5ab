"""When the server is gone: one clear state, and a Stop that does not pretend."""

import re
from typing import Any

import pytest
from playwright.sync_api import Browser, BrowserContext, Route, expect
from tests.fixtures.browser import Home, ask, needs_browser, open_studio, release, until, visiting
from tests.fixtures.waiting import until as is_so

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


class Wire:
    """The connection of a visitor's pages to the server; it can be cut."""

    def __init__(self, context: BrowserContext) -> None:
        self._context, self._lines, self._is_cut = context, list[Any](), False
        context.route_web_socket("**", self._line)

    def _line(self, line: Any) -> None:
        if self._is_cut:
            line.close()
        else:
            line.connect_to_server()
            self._lines.append(line)

    def cut(self, *, requests: bool = True) -> None:
        """Let nothing through, or requests alone."""
        self._is_cut = True
        if requests:
            self._context.route("**", lambda route: route.abort())
        for line in self._lines:
            line.close()

    def mend(self) -> None:
        """Let everything through again."""
        self._is_cut = False
        self._context.unroute_all()


def test_the_pages_say_once_that_stop_reaches_nobody_and_send_it_later(
    browser: Browser, home: Home
) -> None:
    """The studio in Japanese, and the face in English, which is opened again."""
    with (
        visiting(browser, locale="en") as english,
        visiting(browser, locale="ja") as japanese,
    ):
        wires = [Wire(english), Wire(japanese)]
        studio, face = japanese.new_page(), english.new_page()
        open_studio(studio, home.url)
        expect(studio.locator(".pill")).to_have_text(ALIVE)
        face.goto(home.url + "/face")
        expect(face.get_by_role("button", name="Stop", exact=True)).to_be_visible()
        for wire in wires:
            wire.cut()
        expect(face.get_by_role("alert")).to_contain_text("Stop cannot reach it")
        face.get_by_role("button", name=NO_STOP["en"]).click()
        expect(studio.get_by_role("alert").filter(has_text=ALONE)).to_be_visible()
        studio.wait_for_timeout(2500)  # NiceGUI's own message would have come
        for part in (".levels", ".talk button"):
            expect(studio.locator(part)).to_have_attribute("inert", "")
        text = studio.evaluate("document.body.innerText")  # all that somebody sees
        assert not ALIVE.search(text)
        assert text.count(ALONE) == 1
        assert not re.search("[Cc]onnection lost|[Rr]econnect", text)
        studio.get_by_role("button", name=NO_STOP["ja"]).click()
        expect(studio.locator(".unsent")).to_be_visible()
        face.goto("about:blank")
        assert not home.runner.held
        wires[1].mend()
        until(studio, lambda now: now["held"])
        expect(studio.locator(".stop-button .reached")).to_be_visible()
        expect(studio.locator(".unsent")).to_be_hidden()
        expect(studio.locator(".levels")).not_to_have_attribute("inert", "")
        release(studio)
        is_so(lambda: not home.runner.held)
        wires[0].mend()
        face.goto(home.url + "/face")
        until(face, lambda now: now["held"])
        release(face)


@pytest.mark.parametrize("where", ["/", "/face"])
def test_what_was_being_typed_is_still_there_when_the_connection_is_back(
    browser: Browser, home: Home, where: str
) -> None:
    """Also where the studio loads anew, as it does after a while."""
    with visiting(browser) as visitor:
        wire, page = Wire(visitor), visitor.new_page()
        page.goto(home.url + where)
        page.wait_for_function("document.documentElement.dataset.connected === 'true'")
        if where == "/face":
            page.get_by_text("Say something", exact=True).click()
        line = page.get_by_label("Say something to it")
        line.press_sequentially("I am so")
        wire.cut()
        page.wait_for_function("document.documentElement.dataset.connected === 'false'")
        line.press_sequentially(" glad")
        expect(line).to_be_focused()
        ask(page, "/stop")
        wire.mend()
        page.reload()
        expect(page.locator("#said")).to_have_text("Connected again. The robot is stopped.")
        release(page)
        if where == "/face":
            page.get_by_text("Say something", exact=True).click()
        expect(line).to_have_value("I am so glad")
        expect(line).to_be_focused()


@pytest.mark.parametrize("answered", [True, False])
def test_a_stop_that_was_carried_out_is_not_sent_as_a_new_one(
    browser: Browser, home: Home, answered: bool
) -> None:
    """The page's WebSocket is away, and perhaps the answer to its request is lost."""

    def lose_answer(route: Route) -> None:
        route.fetch()
        route.abort()

    with visiting(browser) as visitor:
        wire = Wire(visitor)
        face = visitor.new_page()
        face.goto(home.url + "/face")
        expect(face.get_by_role("button", name="Stop", exact=True)).to_be_visible()
        if not answered:
            visitor.route("**/api/v1/stop", lose_answer)
        wire.cut(requests=False)
        face.get_by_role("button", name=NO_STOP["en"]).click()
        face.wait_for_function("document.documentElement.dataset.unsent")
        expect(face.locator(".unsent")).to_be_visible(visible=not answered)
        assert home.runner.held
        is_so(lambda: release(face) == 204)
        wire.mend()
        face.wait_for_function("document.documentElement.dataset.connected === 'true'")
        expect(face.locator(".unsent")).to_be_hidden()
        serial = home.runner.snapshot.serial
        is_so(lambda: home.runner.snapshot.serial > serial + 20)
        assert not home.runner.held


def test_a_connection_that_hangs_as_it_opens_is_begun_anew(browser: Browser, url: str) -> None:
    with visiting(browser) as visitor:
        visitor.add_init_script(HANGS)
        page = visitor.new_page()
        page.clock.install()
        page.goto(url + "/face")
        page.wait_for_function("window.hung")
        page.clock.run_for(30_000)
        page.wait_for_function("document.documentElement.dataset.connected === 'true'")
