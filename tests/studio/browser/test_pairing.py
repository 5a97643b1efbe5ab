"""A device that nobody knows yet: it is led to https, to the pairing page, and to its wish."""

import base64
import hashlib
from collections.abc import Iterator
from urllib.parse import urlsplit

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat
from playwright.sync_api import Browser, Error, Page, expect
from tests.fixtures.browser import (
    CHROMIUM,
    FLAGS,
    Home,
    look_over,
    needs_browser,
    open_studio,
    visiting,
)

pytestmark = needs_browser

SECURE = "[isSecureContext, !!navigator.mediaDevices, !!window.DeviceMotionEvent]"
WORDS = {
    "en": ("Pair this device", "This is not this partner's token"),
    "ja": ("この端末を登録する", "このロボットのトークンではありません"),
}


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
    browser: Browser, home: Home, language: str
) -> None:
    """The browser ignores the certificate, as after its warning."""
    pair, wrong = WORDS[language]
    with visiting(browser, locale=language, ignore_https_errors=True) as context:
        page = context.new_page()
        page.goto(home.safe + "/face")
        page.wait_for_url("**/pair#/face")
        page.locator("summary").click()
        found = look_over(page, "pairing")
        page.get_by_role("textbox").fill("nonsense")
        page.get_by_role("button", name=pair).click()
        expect(page.get_by_role("status")).to_contain_text(wrong)
        page.get_by_role("textbox").fill(home.keys.token)
        page.get_by_role("button", name=pair).click()
        page.wait_for_url("**/face")
        page.wait_for_function("document.documentElement.dataset.connected === 'true'")
        home.keys.forget()  # as `miburi devices forget --all` does: it must be paired again
        page.wait_for_url("**/pair#/*")
    assert found == []


def test_by_plain_http_a_phone_is_led_to_https_and_warned(browser: Browser, home: Home) -> None:
    with visiting(browser) as context:
        page = context.new_page()
        page.goto(home.plain + "/pair?lang=ja")
        page.locator("summary").click()
        found = look_over(page, "by plain http")
        page.goto(home.plain + "/face")
        page.wait_for_url("**/pair#/face")
        onward = page.get_by_role("link", name="Continue over https")
        expect(onward).to_have_attribute("href", home.safe + "/pair#/face")
        expect(page.get_by_role("textbox")).to_have_count(0)
        page.get_by_text("No more warnings").click()
        with page.expect_download() as saved:
            page.get_by_role("link", name="Download its certificate").click()
        assert saved.value.path().read_bytes() == home.certificates.authority.read_bytes()
        with pytest.raises(Error, match="ERR_CERT_AUTHORITY_INVALID"):
            page.goto(home.safe + "/pair")
    assert found == []


@pytest.fixture
def phone(browser: Browser, home: Home) -> Iterator[Page]:
    """A phone whose owner has accepted the warning, for this certificate alone."""
    certificate = x509.load_pem_x509_certificate(home.certificates.server.read_bytes())
    key = certificate.public_key().public_bytes(Encoding.DER, PublicFormat.SubjectPublicKeyInfo)
    known = base64.b64encode(hashlib.sha256(key).digest()).decode()
    trusting = browser.browser_type.launch(
        executable_path=str(CHROMIUM),
        args=[*FLAGS, f"--ignore-certificate-errors-spki-list={known}"],
    )
    with visiting(trusting) as context:
        yield context.new_page()
    trusting.close()


@pytest.mark.proof("test_by_plain_http_a_phone_is_led_to_https_and_warned")
def test_a_phone_that_scans_the_code_gets_camera_microphone_motion_and_studio(
    phone: Page, home: Home
) -> None:
    sockets: list[str] = []
    phone.on("websocket", lambda socket: sockets.append(socket.url))
    phone.goto(f"{home.safe}/pair#{home.keys.token}/face")
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
    open_studio(phone, home.safe + "/")
