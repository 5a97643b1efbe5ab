"""One live partner, one browser, and one tab, which is a new visitor's in each test.

A page that is opened in a tab that was there costs a third of what it costs in a new one.
"""

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, sync_playwright
from tests.fixtures.browser import (
    CHROMIUM,
    FLAGS,
    PHONE,
    WIDE,
    Home,
    at_home,
    open_studio,
    release,
    visiting,
)

#: Where a page may look: on this computer.
HERE = re.compile(r"data:|blob:|http://(127\.0\.0\.1|localhost)[:/]")


@pytest.fixture(scope="package")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=str(CHROMIUM), args=FLAGS)
        yield browser
        browser.close()


@pytest.fixture(scope="package")
def home(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Home]:
    with at_home(tmp_path_factory.mktemp("home")) as home:
        yield home


@pytest.fixture(scope="package")
def url(home: Home) -> str:
    return home.url


@pytest.fixture(scope="package")
def trouble() -> list[str]:
    """What the pages complained of, and where else they looked."""
    return []


@pytest.fixture(scope="package")
def context(browser: Browser, trouble: list[str]) -> Iterator[BrowserContext]:
    """A visitor whose pages must stay on this computer and be quiet; see ``page``."""

    def watch(page: Page) -> None:
        page.on("pageerror", lambda error: trouble.append(str(error)))
        page.on("console", lambda said: said.type == "error" and trouble.append(said.text))
        page.on(
            "request",
            lambda one: HERE.match(one.url) or trouble.append(f"asked for {one.url}"),
        )

    with visiting(browser) as context:
        context.on("page", watch)
        yield context


@pytest.fixture
def page(
    request: pytest.FixtureRequest, context: BrowserContext, url: str, trouble: list[str]
) -> Iterator[Page]:
    """The tab, as a visitor has it who was never here; the partner is well and free afterwards."""
    page = context.pages[0] if context.pages else context.new_page()
    failed = request.session.testsfailed
    trouble.clear()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(page, "route_web_socket", _needs_own_tab)
        yield page
    if page.url.startswith(url):
        page.evaluate("localStorage.clear(), sessionStorage.clear()")
    page.unroute_all()
    page.goto(url + "/privacy")  # quiet, and `release` needs an address
    for path, content in (
        ("hand", {"position": None}),
        ("pause", {"paused": False}),
        ("recordings", {"on": False}),
    ):
        page.request.post(f"{url}/api/v1/{path}", data=content)
    release(page)
    for one in context.pages[0 if request.session.testsfailed > failed else 1 :]:
        one.close()
    context.clear_cookies()
    if not page.is_closed():
        page.set_viewport_size(WIDE)
        page.emulate_media(color_scheme="light", reduced_motion="reduce")
    assert [words for words in trouble if "409" not in words] == []


def _needs_own_tab(*_: object) -> None:
    pytest.fail("a tab keeps its sockets' routes for all that come after; take `own_tab`.")


@pytest.fixture
def own_tab(page: Page) -> Page:
    """A second tab, which is closed after the test; the partner is well and free afterwards."""
    return page.context.new_page()


@pytest.fixture
def studio(page: Page, url: str) -> Page:
    """The studio, in a browser that draws no 3D."""
    open_studio(page, url)
    return page


@pytest.fixture
def scene(page: Page, url: str) -> Page:
    """The studio with its scene in 3D, which takes a core."""
    open_studio(page, url + "/?quality=low")
    page.wait_for_function("document.querySelector('.robot-view')?.view?.ready")
    return page


@pytest.fixture
def face(page: Page, url: str) -> Page:
    """The face on a phone."""
    page.set_viewport_size(PHONE)
    page.goto(url + "/face")
    page.wait_for_function("document.documentElement.dataset.connected === 'true'")
    return page


@pytest.fixture
def workbench(page: Page, url: str) -> Page:
    """A page without a partner, to call our own modules in."""
    page.goto(url + "/face?show=happiness:1&still")
    return page
