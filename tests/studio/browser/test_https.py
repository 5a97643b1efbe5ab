"""A phone that comes by https, and one that comes without: what each browser grants."""

import base64
import hashlib
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat
from playwright.sync_api import Browser, Error, Page, expect
from tests.fixtures.browser import CHROMIUM, FLAGS, PATIENCE, needs_browser
from tests.fixtures.live import started_by_https

pytestmark = needs_browser

SECURE = "[isSecureContext, !!navigator.mediaDevices, !!window.DeviceMotionEvent]"


@pytest.fixture(scope="module")
def partner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, str, str]]:
    """A partner by https: its folder, and its addresses by http and by https."""
    folder = tmp_path_factory.mktemp("safe")
    with started_by_https(folder) as (url, safe):
        yield folder, url, safe


@pytest.fixture
def phone(browser: Browser, partner: tuple[Path, str, str]) -> Iterator[Page]:
    """A phone whose owner has gone on after the warning, for this certificate alone."""
    folder, _, _ = partner
    certificate = x509.load_pem_x509_certificate((folder / "https" / "server.pem").read_bytes())
    key = certificate.public_key().public_bytes(Encoding.DER, PublicFormat.SubjectPublicKeyInfo)
    known = base64.b64encode(hashlib.sha256(key).digest()).decode()
    trusting = browser.browser_type.launch(
        executable_path=str(CHROMIUM),
        args=[*FLAGS, f"--ignore-certificate-errors-spki-list={known}"],
    )
    page = trusting.new_page(locale="en-GB")
    page.set_default_timeout(PATIENCE)
    yield page
    trusting.close()


def test_a_phone_that_scans_the_code_gets_camera_microphone_and_motion(
    phone: Page, partner: tuple[Path, str, str]
) -> None:
    folder, _, safe = partner
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


def test_the_studio_lives_by_https(phone: Page, partner: tuple[Path, str, str]) -> None:
    folder, _, safe = partner
    phone.goto(f"{safe}/pair#{(folder / 'token').read_text().strip()}/")
    phone.wait_for_function("window.did_handshake && document.documentElement.dataset.serial")


def test_a_browser_that_knows_nothing_of_the_authority_warns(
    browser: Browser, partner: tuple[Path, str, str]
) -> None:
    page = browser.new_page()
    with pytest.raises(Error, match="ERR_CERT_AUTHORITY_INVALID"):
        page.goto(partner[2] + "/pair")
    page.close()


def test_by_plain_http_a_phone_is_led_to_https(
    browser: Browser, partner: tuple[Path, str, str]
) -> None:
    _, url, safe = partner
    page = browser.new_page(locale="en-GB")
    page.goto(f"http://{urlsplit(safe).hostname}:{urlsplit(url).port}/face")
    page.wait_for_url("**/pair#/face")
    expect(page.get_by_role("link", name="Go on by https")).to_have_attribute(
        "href", safe + "/pair#/face"
    )
    expect(page.get_by_role("textbox")).to_have_count(0)
    page.get_by_text("No more warnings").click()
    with page.expect_download() as saved:
        page.get_by_role("link", name="Download its certificate").click()
    assert saved.value.path().read_bytes() == (partner[0] / "https" / "ca.pem").read_bytes()
    page.close()


@pytest.mark.parametrize(
    ("language", "words"),
    [("en", "localhost or over https; this page is neither"), ("ja", "localhost か https")],
)
def test_what_plain_http_cannot_do_is_grey_and_says_why(
    browser: Browser, url: str, language: str, words: str
) -> None:
    """As on a phone that came by plain http: browsers take no such page for secure."""
    page = browser.new_page(locale=language)
    page.add_init_script("Object.defineProperty(window, 'isSecureContext', { value: false })")
    page.goto(url + "/face")
    page.locator(".senses summary").click()
    for name in ("motion", "ears", "eyes"):
        expect(page.locator(f"[data-sense={name}]")).to_be_disabled()
        expect(page.locator(f"#about-{name}")).to_contain_text(words)
        expect(page.locator(f"#about-{name}")).to_contain_text("miburi run --https")
    expect(page.locator("[data-sense=voice]")).to_be_enabled()
    page.close()
