"""The pages on a phone, with a finger; and what a reload keeps."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, expect
from tests.fixtures.browser import (
    PATIENCE,
    ask,
    needs_browser,
    on_screen,
    press_above,
    release,
    until,
    without_3d,
)

pytestmark = needs_browser


@pytest.fixture
def phone(browser: Browser, url: str) -> Iterator[Page]:
    context = browser.new_context(
        viewport={"width": 390, "height": 780}, has_touch=True, is_mobile=True, locale="en-GB"
    )
    context.set_default_timeout(PATIENCE)
    page = context.new_page()
    page.goto(url + "/?quality=low")
    page.wait_for_function(
        "window.did_handshake && document.querySelector('.robot-view')?.view?.ready"
    )
    yield page
    context.close()


def test_stop_is_large_in_a_single_row_and_the_rest_is_behind_a_button(phone: Page) -> None:
    ask(phone, "/stop")
    expect(phone.get_by_role("button", name="Release", exact=True)).to_be_visible()
    for name in ("Stop", "Release"):
        button = phone.get_by_role("button", name=name, exact=True)
        expect(button).to_be_in_viewport(ratio=1)
        box = button.bounding_box()
        assert box is not None
        assert box["height"] >= 56
        assert box["width"] >= 72
    header = phone.locator("header").bounding_box()
    assert header is not None
    assert header["height"] <= 80
    release(phone)
    press_above(phone, "Pause")
    until(phone, lambda now: now["paused"])
    ask(phone, "/pause", paused=False)


def swipe(page: Page, x: float, y: float, way: float) -> None:
    """Draw a finger up (a negative way) or down."""
    devtools = page.context.new_cdp_session(page)

    def touch(kind: str, *points: float) -> None:
        touches = [{"x": x, "y": point} for point in points]
        devtools.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": touches})
        page.wait_for_timeout(30)

    touch("touchStart", y)
    for step in range(1, 11):
        touch("touchMove", y + way * step / 10)
    touch("touchEnd")


def test_a_finger_scrolls_past_the_robot_and_still_drags_the_hand(phone: Page) -> None:
    phone.get_by_role("button", name="Got it").tap()  # else the hint moves the scene down
    box = phone.locator(".robot-view canvas").bounding_box()
    assert box is not None
    swipe(phone, box["x"] + box["width"] / 2, box["y"] + 0.7 * box["height"], -200)
    phone.wait_for_function("scrollY > 100")
    phone.evaluate("scrollTo(0, 0)")
    phone.get_by_role("button", name="Reach in").tap()
    out = until(phone, lambda now: now["hand_out"] and now["hand"]["position"][0] < 0.06)
    swipe(phone, *on_screen(phone, out["hand"]["position"]), -80)
    until(phone, lambda now: now["hand"]["position"][2] > out["hand"]["position"][2] + 0.02)
    assert phone.evaluate("scrollY") == 0
    ask(phone, "/hand", position=None)


def test_a_page_can_be_enlarged(phone: Page, url: str) -> None:
    for path in ("/", "/face"):
        phone.goto(url + path)
        content = phone.locator("meta[name=viewport]").get_attribute("content")
        assert content is not None
        assert "user-scalable" not in content
        assert "maximum-scale" not in content


def test_a_reload_keeps_the_tab_and_the_strength(browser: Browser, url: str) -> None:
    context = browser.new_context(locale="en-GB")
    page = without_3d(context, url)
    page.get_by_role("tab", name="Body").click()
    slider = page.get_by_role("slider", name="Strength of a remark")
    slider.locator("[tabindex]").focus()
    page.keyboard.press("ArrowLeft")
    expect(slider).to_have_attribute("aria-valuenow", "0.65")
    page.reload()
    expect(page.get_by_role("tab", name="Body")).to_have_attribute("aria-selected", "true")
    expect(page.get_by_role("slider", name="Strength of a remark")).to_have_attribute(
        "aria-valuenow", "0.65"
    )
    page.wait_for_function("window.did_handshake")
    page.locator("[data-feeling=anger]").focus()
    page.keyboard.press("Enter")
    page.get_by_role("tab", name="Contact").click()
    expect(page.locator(".log")).to_contain_text("anger, strength 0.65")
    context.close()
