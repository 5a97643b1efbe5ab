"""The content security policy, as a browser holds the pages to it."""

import pytest
from playwright.sync_api import Browser, expect
from tests.fixtures.browser import PHONE, needs_browser, switch, visiting

pytestmark = needs_browser

#: A camera that sees nobody.
CAMERA = """navigator.mediaDevices.getUserMedia = async () => {
  const canvas = document.createElement("canvas"), context = canvas.getContext("2d");
  setInterval(() => context.fillRect(0, 0, 50, 50), 100);
  return canvas.captureStream();
};"""
#: Needs of the eyes' neural networks: WebAssembly, and a worker that is made of a text.
NETWORK = """async () => {
  await WebAssembly.compile(new Uint8Array([0, 97, 115, 109, 1, 0, 0, 0]));
  new Worker(URL.createObjectURL(new Blob([""]))).terminate();
}"""


def test_a_page_needs_nothing_that_its_policy_forbids(browser: Browser, url: str) -> None:
    """Nothing forbids enlarging a page, either."""
    trouble: list[str] = []
    with visiting(browser, bypass_csp=False, viewport=PHONE) as context:
        page = context.new_page()
        page.on("pageerror", lambda error: trouble.append(str(error)))
        page.on("console", lambda said: said.type == "error" and trouble.append(said.text))
        for where in ("/privacy", "/mistyped", "/", "/face"):
            answer = page.goto(url + where)
            assert answer is not None
            policy = answer.headers["content-security-policy"]
            assert ("'unsafe-inline'" in policy) == ("'unsafe-eval'" in policy) == (where == "/")
            if where in ("/face", "/"):
                expect(page.locator("html")).to_have_attribute("data-connected", "true")
                expect(page.get_by_role("button", name="Stop", exact=False)).to_be_visible()
                content = page.locator("meta[name=viewport]").get_attribute("content") or ""
                assert "width" in content
                assert "user-scalable" not in content
                assert "maximum-scale" not in content
        page.evaluate(NETWORK)
        assert [words for words in trouble if "404" not in words] == []
        # A stranger's script does not run in the face.
        page.evaluate("""() => {
          const script = document.createElement("script");
          script.textContent = "document.title = 'taken'";
          document.body.append(script);
        }""")
        assert page.title() != "taken"
        assert any("Content Security Policy" in words for words in trouble)


@pytest.mark.proof("test_a_page_needs_nothing_that_its_policy_forbids")
def test_the_eyes_work_under_the_policy(browser: Browser, url: str) -> None:
    with visiting(browser, bypass_csp=False) as context:
        context.add_init_script(CAMERA)
        page = context.new_page()
        trouble: list[str] = []
        page.on("pageerror", lambda error: trouble.append(str(error)))
        page.goto(url + "/face")
        page.locator(".senses summary").click()
        switch(page, "Eyes", "Watching")
        assert trouble == []
