"""The whole way by keyboard alone: nothing is clicked."""

from playwright.sync_api import Page, expect
from tests.fixtures.browser import ask, needs_browser, posts, release_by_key, tab_to, until

pytestmark = needs_browser


def test_everything_is_done_by_keyboard(studio: Page) -> None:
    page = studio
    press = page.keyboard.press
    tab_to(page, "Face")
    press("Enter")
    expect(page.get_by_role("dialog").locator(".qr")).to_be_visible()
    tab_to(page, "Close")
    press("Enter")
    expect(page.get_by_role("dialog")).to_be_hidden()
    tab_to(page, "Stop")
    press("Enter")
    until(page, lambda now: now["phase"] == "stopped")
    release_by_key(page)
    tab_to(page, "Got it")
    press("Enter")
    tab_to(page, "Reach in")
    press("Enter")
    until(page, lambda now: now["hand_out"])
    tab_to(page, "thrill")
    press("Enter")
    until(page, lambda now: now["emotion"][4] > 0.3)
    tab_to(page, "Say something to it")
    page.keyboard.type("I am so angry")
    press("Enter")
    expect(page.locator(".talk output")).to_contain_text("I heard anger")
    tab_to(page, "Contact")
    press("ArrowRight")
    press("ArrowRight")
    press("Enter")
    expect(page.get_by_role("tab", name="Gestures")).to_have_attribute("aria-selected", "true")
    tab_to(page, "Gesture")
    page.keyboard.type("surp")
    tab_to(page, "Perform")
    press("Enter")
    until(page, lambda now: now["asked"] and now["expressed"]["feeling"] == "surprise")
    press("Escape")
    until(page, lambda now: now["stop"] and now["stop"]["reason"] == "asked")


def test_what_is_typed_on_the_face_goes_into_its_line_and_releases_nothing(face: Page) -> None:
    ask(face, "/stop")
    face.wait_for_function("document.documentElement.dataset.phase === 'stopped'")
    sent = posts(face, "release")
    face.keyboard.type("are")
    face.get_by_text("Say something", exact=True).press("Enter")
    line = face.get_by_label("Say something to it")
    expect(line).to_be_focused()
    face.keyboard.type("are")
    expect(line).to_have_value("are")
    with face.expect_response("**/stop"):
        face.keyboard.press("Escape")
    assert sent == []
