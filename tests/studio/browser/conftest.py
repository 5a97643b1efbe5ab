"""A live partner, a browser, and a visitor with an open page."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, sync_playwright
from tests.fixtures.browser import CHROMIUM, FLAGS, PATIENCE, RELEASE
from tests.fixtures.live import address, started


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=str(CHROMIUM), args=FLAGS)
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with started(tmp_path_factory.mktemp("partner"), "--forget") as said:
        yield address(said)


@pytest.fixture
def context(browser: Browser, url: str) -> Iterator[BrowserContext]:
    """A visitor with an empty browser; every page must stay on this computer and be quiet."""
    context = browser.new_context(viewport={"width": 1180, "height": 520}, locale="en-GB")
    context.set_default_timeout(PATIENCE)
    trouble: list[str] = []

    def look(page: Page) -> None:
        page.on("pageerror", lambda error: trouble.append(str(error)))
        page.on("console", lambda said: said.type == "error" and trouble.append(said.text))
        page.on(
            "request",
            lambda request: (
                request.url.startswith((url, "data:", "blob:"))
                or trouble.append(f"asked for {request.url}")
            ),
        )

    context.on("page", look)
    yield context
    context.request.post(url + "/api/v1/hand", data={"position": None})
    context.request.post(url + RELEASE, data={}, headers={"Origin": url})
    context.request.post(url + "/api/v1/pause", data={"paused": False})
    context.request.post(url + "/api/v1/recordings", data={"on": False})
    context.close()
    assert [words for words in trouble if "409" not in words] == []


@pytest.fixture
def studio(context: BrowserContext, url: str) -> Page:
    page = context.new_page()
    page.goto(url + "/?quality=low")
    # Drawn, and greeted by the server: a page that is not yet greeted may still load anew.
    page.wait_for_function(
        "window.did_handshake && document.querySelector('.robot-view')?.view?.ready"
    )
    return page


@pytest.fixture(scope="module")
def workbench(browser: Browser, url: str) -> Iterator[Page]:
    """A page without a partner, to call our own modules in."""
    page = browser.new_page()
    page.goto(url + "/face?show=happiness:1&still")
    yield page
    page.close()
