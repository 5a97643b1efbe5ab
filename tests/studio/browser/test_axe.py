"""Every page against axe-core, the accessibility checker of others: light, dark, laptop, phone."""

import re
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urljoin, urlsplit

import pytest
from playwright.sync_api import Browser, Page, expect
from tests.fixtures.broker import Listener, Mosquitto
from tests.fixtures.browser import (
    PATIENCE,
    ask,
    needs_browser,
    press_above,
    release,
    settle,
    until,
    violations,
    without_3d,
)
from tests.fixtures.live import serving, started, started_by_https
from tests.studio.browser.test_speech import RECOGNISER

from miburi.interface.access import Gate
from miburi.interface.broker import find_broker
from miburi.interface.fleet import Fleet
from miburi.interface.report import HomeReport, Topics
from miburi.safety.stop import StopReason
from miburi.studio.fleet_page import make_fleet_app
from miburi.studio.words import LANGUAGES

pytestmark = needs_browser

LAPTOP, PHONE = (1280, 800), (390, 844)


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, str]]:
    """A partner that other devices reach: its address and its token."""
    folder: Path = tmp_path_factory.mktemp("guarded")
    with started(folder, "--forget", "--host", "0.0.0.0") as said:
        found = re.search(r"http://127.0.0.1:\d+", said)
        assert found, said
        yield found.group(), (folder / "token").read_text().strip()


@pytest.fixture(scope="module")
def safely(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, str]]:
    """A partner that phones reach by https: its two addresses."""
    with started_by_https(tmp_path_factory.mktemp("safely")) as addresses:
        yield addresses


@pytest.fixture(params=[(LAPTOP, "light"), (LAPTOP, "dark"), (PHONE, "light"), (PHONE, "dark")],
                ids=lambda case: f"{case[0][0]}-{case[1]}")  # fmt: skip
def visitor(request: pytest.FixtureRequest, browser: Browser) -> Iterator[Page]:
    (width, height), light = request.param
    phone = (width, height) == PHONE
    context = browser.new_context(
        viewport={"width": width, "height": height}, color_scheme=light, locale="en-GB",
        has_touch=phone, is_mobile=phone, reduced_motion="reduce",
    )  # fmt: skip
    context.set_default_timeout(PATIENCE)
    yield context.new_page()
    context.close()


def test_the_studio_has_no_violation_whatever_is_open(visitor: Page, url: str) -> None:
    page = without_3d(visitor.context, url)
    page.locator(".senses summary").click()
    found: list[str] = []
    for tab in ("Contact", "Time", "Gestures", "Body"):
        page.get_by_role("tab", name=tab).click()
        settle(page)
        found += violations(page, tab)
    press_above(page, "Face")
    expect(page.locator(".q-dialog .card")).to_be_visible()
    settle(page)
    found += violations(page, "the dialog")
    page.get_by_role("button", name="Close").click()
    page.get_by_role("button", name="Reach in").click()
    until(page, lambda now: now["hand_out"])
    ask(page, "/stop")
    expect(page.locator(".why")).to_be_visible()
    settle(page)
    found += violations(page, "stopped")
    ask(page, "/hand", position=None)
    release(page)
    assert "\n".join(found) == ""


def test_the_face_has_no_violation(visitor: Page, url: str) -> None:
    visitor.goto(url + "/face")
    visitor.wait_for_function("document.documentElement.dataset.connected === 'true'")
    visitor.locator(".senses summary").click()
    found = violations(visitor, "awake")
    visitor.request.post(urljoin(url, "/api/v1/stop"))
    expect(visitor.locator("#release")).to_be_visible()
    found += violations(visitor, "stopped")
    release(visitor)
    assert "\n".join(found) == ""


@pytest.mark.parametrize("where", ["/face", "/"])
def test_push_to_talk_has_no_violation(visitor: Page, url: str, where: str) -> None:
    """Before somebody speaks, meanwhile, and with an answer."""
    visitor.add_init_script(RECOGNISER % ("available", "true"))
    visitor.goto(url + where)
    visitor.wait_for_function("document.documentElement.dataset.connected === 'true'")
    visitor.locator(".senses summary").click()
    visitor.get_by_role("switch", name="Spoken words").click()
    if where == "/face":
        visitor.locator(".senses summary").click()
        visitor.get_by_text("Say something", exact=True).click()
    speak = visitor.get_by_role("button", name="Hold and speak")
    speak.focus()
    found = violations(visitor, "ready")
    visitor.keyboard.press("Enter")
    listening = visitor.get_by_role("button", name="Listening")
    expect(listening).to_have_attribute("aria-pressed", "true")
    found += violations(visitor, "listening")
    visitor.keyboard.press("Enter")
    expect(visitor.locator(".talk output")).to_contain_text("sadness")
    found += violations(visitor, "answered")
    assert "\n".join(found) == ""


@pytest.mark.parametrize("where", ["/privacy", "/mistyped"])
@pytest.mark.parametrize("language", LANGUAGES)
def test_pages_to_read_have_no_violation(
    visitor: Page, url: str, language: str, where: str
) -> None:
    visitor.goto(f"{url}{where}?lang={language}")
    assert violations(visitor, language) == []
    width = visitor.evaluate("[document.documentElement.scrollWidth, innerWidth]")
    assert width[0] <= width[1]


@pytest.mark.parametrize("language", LANGUAGES)
def test_the_pages_that_lead_to_https_have_no_violation(
    visitor: Page, safely: tuple[str, str], browser: Browser, language: str
) -> None:
    """On the way there by plain http, and there, where the warning was gone past."""
    url, safe = safely
    visitor.goto(f"http://{urlsplit(safe).hostname}:{urlsplit(url).port}/pair?lang={language}")
    visitor.locator("summary").click()
    found = violations(visitor, "by http")
    phone = browser.new_context(ignore_https_errors=True, viewport=visitor.viewport_size)
    page = phone.new_page()
    page.goto(f"{safe}/pair?lang={language}")
    page.locator("summary").click()
    found += violations(page, "by https")
    phone.close()
    assert found == []


def test_the_fleet_has_no_violation(visitor: Page, broker: Mosquitto, listener: Listener) -> None:
    """One partner is well, one is stopped, one is lost; then the broker is lost, too."""
    for name, stopped in (("hall", None), ("kitchen", StopReason.CONTACT), ("attic", None)):
        listener.say(
            Topics(name).available, "offline" if name == "attic" else "online", retain=True
        )
        report = HomeReport(
            feeling="happiness", mood=60, body="stopped" if stopped else "moving", paused=False,
            stopped=stopped, motor="waist" if stopped else None, held=False, stops_today=3,
            temperatures={"waist": 41.0},
        )  # fmt: skip
        listener.say(Topics(name).report, report.model_dump_json(), retain=True)
    fleet = Fleet(find_broker(f"127.0.0.1:{broker.port}"))
    with serving(Gate(make_fleet_app(fleet)), lifespan=True) as url:
        visitor.goto(url)
        expect(visitor.locator("tr.stopped")).to_contain_text("waist")
        expect(visitor.locator("tr.lost")).to_have_count(1)
        found = violations(visitor, "the fleet")
        broker.kill()
        expect(visitor.locator("[role=alert]")).not_to_be_empty()
        found += violations(visitor, "without its broker")
    assert found == []


def test_the_pairing_page_has_no_violation(visitor: Page, guarded: tuple[str, str]) -> None:
    url, token = guarded
    visitor.goto(url + "/pair")
    found = violations(visitor, "pairing")
    visitor.goto("about:blank")
    visitor.goto(f"{url}/pair#{token}/")
    visitor.wait_for_function("window.did_handshake")
    press_above(visitor, "Face")
    settle(visitor)
    found += violations(visitor, "the dialog")
    assert "\n".join(found) == ""
