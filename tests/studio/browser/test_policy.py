"""The content security policy, as a browser holds the pages to it."""

import pytest
from playwright.sync_api import Browser, expect
from tests.fixtures.browser import PHONE, fake_media, needs_browser, visiting

pytestmark = needs_browser


@pytest.mark.parametrize("where", ["/face", "/privacy", "/mistyped", "/"])
def test_a_page_needs_nothing_that_its_policy_forbids(
    browser: Browser, url: str, where: str
) -> None:
    trouble: list[str] = []
    with visiting(browser, bypass_csp=False, viewport=PHONE) as context:
        page = context.new_page()
        page.on("pageerror", lambda error: trouble.append(str(error)))
        page.on("console", lambda said: said.type == "error" and trouble.append(said.text))
        answer = page.goto(url + where)
        assert answer is not None
        policy = answer.headers["content-security-policy"]
        assert ("'unsafe-inline'" in policy) == ("'unsafe-eval'" in policy) == (where == "/")
        if where in ("/face", "/"):
            expect(page.locator("html")).to_have_attribute("data-connected", "true")
            expect(page.get_by_role("button", name="Stop", exact=False)).to_be_visible()
    assert [words for words in trouble if "404" not in words] == []


def test_a_strangers_script_does_not_run_in_the_face(browser: Browser, url: str) -> None:
    with visiting(browser, bypass_csp=False, viewport=PHONE) as context:
        page = context.new_page()
        page.goto(url + "/face")
        expect(page.locator("html")).to_have_attribute("data-connected", "true")
        refused: list[str] = []
        page.on("console", lambda said: refused.append(said.text))
        page.evaluate("""() => {
          const script = document.createElement("script");
          script.textContent = "document.title = 'taken'";
          document.body.append(script);
        }""")
        assert page.title() != "taken"
        assert any("Content Security Policy" in words for words in refused)


def test_the_eyes_work_under_the_policy(browser: Browser, url: str) -> None:
    """They bring neural networks in WebAssembly."""
    with fake_media(browser, "--use-fake-device-for-media-stream", bypass_csp=False) as page:
        trouble: list[str] = []
        page.on("pageerror", lambda error: trouble.append(str(error)))
        page.goto(url + "/face")
        page.locator(".senses summary").click()
        page.get_by_role("switch", name="Eyes").click()
        expect(page.get_by_text("Watching", exact=True)).to_be_visible()
        assert trouble == []
