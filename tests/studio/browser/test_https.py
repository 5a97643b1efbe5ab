"""A phone that comes by https, and one that comes without: what each browser grants."""

import base64
import hashlib
import re
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat
from playwright.sync_api import Browser, Error, Page, expect
from tests.fixtures.browser import (
    CHROMIUM,
    FLAGS,
    look_over,
    needs_browser,
    open_studio,
    partner,
    visiting,
)
from tests.fixtures.live import address

from miburi.studio.words import LANGUAGES

pytestmark = needs_browser

SECURE = "[isSecureContext, !!navigator.mediaDevices, !!window.DeviceMotionEvent]"


@pytest.fixture(scope="module")
def safely(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, str, str]]:
    """A partner by https: its folder, and its addresses by http and by https."""
    folder = tmp_path_factory.mktemp("safe")
    with partner(folder, "--forget", "--https") as said:
        safe = re.search(r"https://[\w.]+:\d+", said)
        assert safe, f"this computer has no address at home: {said}"
        yield folder, address(said), safe.group()


@pytest.fixture
def phone(browser: Browser, safely: tuple[Path, str, str]) -> Iterator[Page]:
    """A phone whose owner has gone on after the warning, for this certificate alone."""
    folder, _, _ = safely
    certificate = x509.load_pem_x509_certificate((folder / "https" / "server.pem").read_bytes())
    key = certificate.public_key().public_bytes(Encoding.DER, PublicFormat.SubjectPublicKeyInfo)
    known = base64.b64encode(hashlib.sha256(key).digest()).decode()
    trusting = browser.browser_type.launch(
        executable_path=str(CHROMIUM),
        args=[*FLAGS, f"--ignore-certificate-errors-spki-list={known}"],
    )
    with visiting(trusting) as context:
        yield context.new_page()
    trusting.close()


@pytest.mark.proof("test_by_plain_http_a_phone_is_led_to_https")
def test_a_phone_that_scans_the_code_gets_camera_microphone_motion_and_studio(
    phone: Page, safely: tuple[Path, str, str]
) -> None:
    folder, _, safe = safely
    sockets: list[str] = []
    phone.on("websocket", lambda socket: sockets.append(socket.url))
    phone.goto(f"{safe}/pair#{(folder / 'token').read_text().strip()}/face")
    phone.wait_for_url("**/face")
    phone.wait_for_function("document.documentElement.dataset.connected === 'true'")
    assert phone.evaluate(SECURE) == [True, True, True]
    assert {urlsplit(url).scheme for url in sockets} == {"wss"}
    (cookie,) = phone.context.cookies()
    assert (cookie["name"], cookie["secure"], cookie["httpOnly"]) == ("miburi_token", True, True)
    phone.locator(".senses summary").click()
    for name in ("Motion", "Ears", "Eyes"):
        expect(phone.get_by_role("switch", name=name)).to_be_enabled()
    phone.locator("#stop").click()
    expect(phone.locator("#release")).to_be_visible()
    phone.locator("#release").click()
    open_studio(phone, safe + "/")


def test_a_browser_that_knows_nothing_of_the_authority_warns(
    browser: Browser, safely: tuple[Path, str, str]
) -> None:
    with visiting(browser) as context, pytest.raises(Error, match="ERR_CERT_AUTHORITY_INVALID"):
        context.new_page().goto(safely[2] + "/pair")


def test_by_plain_http_a_phone_is_led_to_https(
    browser: Browser, safely: tuple[Path, str, str]
) -> None:
    folder, url, safe = safely
    home = f"http://{urlsplit(safe).hostname}:{urlsplit(url).port}"
    with visiting(browser) as context:
        page = context.new_page()
        page.goto(home + "/face")
        page.wait_for_url("**/pair#/face")
        expect(page.get_by_role("link", name="Continue over https")).to_have_attribute(
            "href", safe + "/pair#/face"
        )
        expect(page.get_by_role("textbox")).to_have_count(0)
        page.get_by_text("No more warnings").click()
        with page.expect_download() as saved:
            page.get_by_role("link", name="Download its certificate").click()
        assert saved.value.path().read_bytes() == (folder / "https" / "ca.pem").read_bytes()


@pytest.mark.proof("test_by_plain_http_a_phone_is_led_to_https")
@pytest.mark.parametrize("language", LANGUAGES)
def test_the_pages_that_lead_to_https_have_no_violation(
    browser: Browser, safely: tuple[Path, str, str], language: str
) -> None:
    """On the way there by plain http, and there, where the warning was gone past."""
    _, url, safe = safely
    home = f"http://{urlsplit(safe).hostname}:{urlsplit(url).port}"
    with visiting(browser, ignore_https_errors=True) as context:
        page, found = context.new_page(), []
        for where in (home, safe):
            page.goto(f"{where}/pair?lang={language}")
            page.locator("summary").click()
            found += look_over(page, where)
    assert found == []
