"""The pages on a phone, with a finger."""

import os
from collections.abc import Iterator
from pathlib import Path

import matplotlib
import pytest
from playwright.sync_api import Browser, Page, expect
from tests.fixtures.browser import (
    CHROMIUM,
    FLAGS,
    PHONE,
    WIDE,
    ask,
    hand_has_come,
    needs_browser,
    press_above,
    release,
    settled_on_screen,
    until,
    visiting,
)

pytestmark = needs_browser


@pytest.fixture
def phone(browser: Browser, url: str) -> Iterator[Page]:
    with visiting(browser, viewport=PHONE, has_touch=True, is_mobile=True) as context:
        page = context.new_page()
        page.goto(url + "/?quality=low")
        page.wait_for_function(
            "window.did_handshake && document.querySelector('.robot-view')?.view?.ready"
        )
        yield page


def test_stop_is_large_in_a_single_row_and_the_rest_is_behind_a_button(studio: Page) -> None:
    studio.set_viewport_size(PHONE)
    ask(studio, "/stop")
    expect(studio.get_by_role("button", name="Release", exact=True)).to_be_visible()
    for name in ("Stop", "Release"):
        button = studio.get_by_role("button", name=name, exact=True)
        expect(button).to_be_in_viewport(ratio=1)
        box = button.bounding_box()
        assert box is not None
        assert box["height"] >= 56
        assert box["width"] >= 72
    header = studio.locator("header").bounding_box()
    assert header is not None
    assert header["height"] <= 80
    release(studio)
    press_above(studio, "Pause")
    until(studio, lambda now: now["paused"])
    # The page says beside Stop whether the camera watches or the microphone listens.
    studio.evaluate("document.documentElement.dataset.eyes = 'on'")
    for size in (PHONE, WIDE):
        studio.set_viewport_size(size)
        for edge in (0, 10_000):
            studio.evaluate("edge => scrollTo(0, edge)", edge)
            expect(studio.get_by_text("Watching", exact=True)).to_be_in_viewport(ratio=1)
    expect(studio.get_by_text("Listening", exact=True)).to_be_hidden()


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


@pytest.mark.proof("test_a_dragged_hand_stops_the_robot_and_release_lets_it_go_on")
def test_a_finger_scrolls_past_the_robot_and_still_drags_the_hand(phone: Page) -> None:
    phone.get_by_role("button", name="Got it").tap()  # else the hint moves the scene down
    box = phone.locator(".robot-view canvas").bounding_box()
    assert box is not None
    swipe(phone, box["x"] + box["width"] / 2, box["y"] + 0.7 * box["height"], -200)
    phone.wait_for_function("scrollY > 100")
    phone.evaluate("scrollTo(0, 0)")
    phone.get_by_role("button", name="Reach in").tap()
    out = until(phone, hand_has_come)
    swipe(phone, *settled_on_screen(phone, out["hand"]["position"]), -80)
    until(phone, lambda now: now["hand"]["position"][2] > out["hand"]["position"][2] + 0.02)
    assert phone.evaluate("scrollY") == 0
    ask(phone, "/hand", position=None)


def test_why_a_sense_stays_off_can_be_read_where_the_panel_is_longer_than_the_phone(
    face: Page,
) -> None:
    face.set_viewport_size({"width": 412, "height": 800})
    face.evaluate(
        "() => { navigator.mediaDevices.getUserMedia = async () =>"
        " { throw new DOMException('', 'NotAllowedError'); }; }"
    )
    face.locator(".senses summary").click()
    face.get_by_role("switch", name="Ears").click()
    reason = face.locator(".senses output")
    expect(reason).to_contain_text("Allow it in the browser's settings")
    panel, box = face.locator(".senses").bounding_box(), reason.bounding_box()
    assert panel is not None
    assert box is not None
    assert panel["y"] <= box["y"]
    assert box["y"] + box["height"] <= min(panel["y"] + panel["height"], 800)


FONTS = """<?xml version="1.0"?><!DOCTYPE fontconfig SYSTEM "fonts.dtd"><fontconfig>
<dir>{}/fonts/ttf</dir><cachedir>{}</cachedir></fontconfig>"""


@pytest.mark.proof("test_stop_is_large_in_a_single_row_and_the_rest_is_behind_a_button")
def test_stop_is_no_boxes_where_the_system_has_no_japanese_font(
    browser: Browser, url: str, tmp_path: Path
) -> None:
    config = tmp_path / "fonts.conf"
    config.write_text(FONTS.format(matplotlib.get_data_path(), tmp_path))
    poor = browser.browser_type.launch(
        executable_path=str(CHROMIUM), args=FLAGS, env=os.environ | {"FONTCONFIG_FILE": str(config)}
    )
    with visiting(poor, locale="ja", viewport=PHONE) as context:
        page = context.new_page()
        for path, stop in (("", ".stop-button .reached"), ("/face", "#stop .reached")):
            page.goto(url + path)
            page.wait_for_function("document.documentElement.dataset.connected === 'true'")
            assert fonts(page, stop)[0] == "Noto Sans CJK JP"
    poor.close()


def fonts(page: Page, selector: str) -> list[str]:
    """Return the fonts whose letters are drawn there."""
    devtools = page.context.new_cdp_session(page)
    for domain in ("DOM", "CSS"):
        devtools.send(f"{domain}.enable")
    root = devtools.send("DOM.getDocument")["root"]["nodeId"]
    node = devtools.send("DOM.querySelector", {"nodeId": root, "selector": selector})
    drawn = devtools.send("CSS.getPlatformFontsForNode", {"nodeId": node["nodeId"]})
    return [each["familyName"] for each in drawn["fonts"]]
