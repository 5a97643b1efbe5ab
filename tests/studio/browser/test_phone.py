"""The pages on a phone, with a finger."""

import itertools
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib
import pytest
from playwright.sync_api import Browser, Page, ViewportSize, expect
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
    see,
    settled_on_screen,
    until,
    visiting,
)

pytestmark = needs_browser

SMALL = ViewportSize(width=360, height=640)


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
    studio.set_viewport_size(SMALL)
    pill = studio.locator(".pill")
    expect(pill).to_have_text("Stopped")
    expect(pill).to_be_in_viewport(ratio=1)
    assert pill.evaluate("one => one.scrollWidth <= one.clientWidth")
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


BOX = """selector => {
  const { left, top, right, bottom } = document.querySelector(selector).getBoundingClientRect();
  return [left, top, right, bottom];
}"""
SAY = "text => document.querySelectorAll('.pill').forEach(pill => { pill.textContent = text; })"


@pytest.mark.parametrize(
    ("where", "stop", "free"),
    [("/", ".stop-button", ".release-button"), ("/face", "#stop", "#release")],
)
def test_stop_keeps_its_place_and_release_never_takes_it(
    page: Page, url: str, where: str, stop: str, free: str
) -> None:
    """A second tap in haste is another Stop, also where the page was not connected before."""
    page.goto(url + where)
    page.wait_for_function("document.documentElement.dataset.connected === 'true'")
    for width, height in ((320, 640), (360, 740), (390, 780), (740, 360), (1180, 520)):
        page.set_viewport_size({"width": width, "height": height})
        lost = page.evaluate(
            f"() => {{ const root = document.documentElement.dataset; root.connected = false;"
            f" const box = ({BOX})('{stop}'); root.connected = true; return box; }}"
        )
        page.evaluate(SAY, "At rest")
        before = page.evaluate(BOX, stop)
        page.evaluate(SAY, "Going back")
        assert page.evaluate(BOX, stop) == before
        page.locator(stop).click()
        page.wait_for_function("document.documentElement.dataset.phase === 'stopped'")
        expect(page.locator(free)).to_be_visible()
        expect(page.locator(".why")).to_be_in_viewport(ratio=1)
        assert page.evaluate(BOX, stop) == before
        left, top, right, bottom = page.evaluate(BOX, free)
        for box in (before, lost):
            beside = right <= box[0] or left >= box[2] or bottom <= box[1] or top >= box[3]
            assert beside, (width, height)
        release(page)
        page.wait_for_function("document.documentElement.dataset.phase !== 'stopped'")


def test_at_400_percent_nothing_on_the_face_lies_on_another(face: Page) -> None:
    face.set_viewport_size({"width": 320, "height": 200})
    ask(face, "/stop")
    expect(face.locator(".why")).to_be_in_viewport(ratio=1)
    expect(face.locator("#release")).to_be_visible()
    boxes = [face.evaluate(BOX, one) for one in ("#now", "#studio", ".senses", "#low", "#face")]
    for one, other in itertools.combinations(sorted(boxes, key=lambda box: box[1]), 2):
        assert one[3] <= other[1]
    for name in ("#stop", "#release"):
        assert face.evaluate(BOX, "main")[3] <= face.evaluate(BOX, name)[1]
        expect(face.locator(name)).to_be_in_viewport(ratio=1)


@pytest.mark.parametrize("width", [320, 360])
def test_no_name_is_cut_on_a_small_phone(studio: Page, width: int) -> None:
    studio.set_viewport_size({"width": width, "height": 640})
    expect(studio.locator(".q-tabs__arrow").first).to_be_hidden()
    cut = studio.evaluate(
        """() => [...document.querySelectorAll(".feel-name, .q-tab__label, .stop-button span")]
          .filter((one) => {
            const range = document.createRange(), button = one.closest(".feel, .q-tab, button");
            range.selectNodeContents(one);
            const box = button.getBoundingClientRect(), lines = [...range.getClientRects()];
            return (lines.length > 1 && !one.matches(".unreached")) ||
              lines.some((line) => line.left < box.left || line.right > box.right);
          }).map((one) => one.textContent)"""
    )
    assert cut == []


@pytest.mark.parametrize("where", ["/", "/face", "/privacy"])
def test_text_is_as_large_as_the_browser_is_told(page: Page, url: str, where: str) -> None:
    page.goto(url + where)
    page.wait_for_function("document.documentElement.dataset.connected === 'true'")
    fixed = page.evaluate(
        """() => {
          const texts = [...document.querySelectorAll("body *")].filter((one) =>
            one.checkVisibility() && [...one.childNodes].some((part) => part.data?.trim()));
          const size = (one) => parseFloat(getComputedStyle(one).fontSize);
          const usual = texts.map(size);
          document.documentElement.style.fontSize = "200%";
          return texts.filter((one, i) => size(one) !== 2 * usual[i]).map((one) => one.outerHTML);
        }"""
    )
    assert fixed == []


@pytest.mark.parametrize(
    ("where", "lined"),
    [
        ("/face", ["#stop", ".why", "#release", "#now", "#talk"]),
        ("/", [".stop-button", ".why", ".release-button", ".bar", ".pill", ".q-slider__track"]),
        ("/privacy", ["#stop"]),
    ],
)
def test_in_the_systems_own_colours_everything_has_a_line(
    page: Page, url: str, where: str, lined: list[str]
) -> None:
    page.emulate_media(forced_colors="active")
    page.goto(url + where)
    page.wait_for_function("document.documentElement.dataset.connected === 'true'")
    ask(page, "/stop")
    page.wait_for_function("document.documentElement.dataset.phase === 'stopped'")
    width = "one => parseFloat(getComputedStyle(one).borderTopWidth)"
    stop, *others = [page.locator(each).first.evaluate(width) for each in lined]
    colour = page.locator(lined[0]).evaluate("one => getComputedStyle(one).backgroundColor")
    page.emulate_media(forced_colors="none")
    assert all(others)
    assert stop > max(others, default=1)
    assert colour == "rgb(198, 40, 40)"


CONTACT = {
    "time": 100.0, "reason": "contact", "motor": "right_elbow", "mood_before": 0.5,
    "mood_after": 0.4,
}  # fmt: skip
#: Collects what an alert holds at each moment at which it appears.
ALERTS = """() => {
  const box = document.querySelector(".why");
  window.alerts = [];
  new MutationObserver(() => box.hidden || alerts.push(box.innerText.replaceAll("\\n", " ")))
    .observe(box, { attributeFilter: ["hidden"] });
}"""


@pytest.mark.parametrize("where", ["/face", "/"])
def test_why_it_stopped_is_told_at_once_and_can_be_read_after_it_went_on(
    own_tab: Page, url: str, where: str
) -> None:
    see(own_tab, now := {"stop": None, "held": False, "phase": "idle", "time": 100.0})
    own_tab.goto(url + where)
    own_tab.wait_for_function("document.querySelector('.why')")
    own_tab.wait_for_function("document.documentElement.dataset.phase === 'idle'")
    own_tab.evaluate(ALERTS)
    why, hide = own_tab.locator(".why"), own_tab.get_by_role("button", name="Hide")
    asked = CONTACT | {"reason": "asked", "motor": None}
    now.update(stop=asked, held=True, phase="stopped")
    expect(why).to_contain_text("It stays stopped until you press Release.")
    now.update(stop=None, held=False, phase="returning")
    expect(why).to_be_hidden()  # who released it knows
    for end in ("time", "Hide"):
        now.update(stop=CONTACT, phase="stopped", time=100.0)
        expect(why).to_contain_text("It releases itself after a while")
        expect(hide).to_be_hidden()
        now.update(stop=None, phase="moving", time=100.5)
        expect(why).not_to_contain_text("It releases itself")
        now.update(time=110.0)
        expect(why).to_have_text(re.compile("The right elbow met something.*Hide"))
        if end == "Hide":
            hide.click()
        now.update(time=120.0)
        expect(why).to_be_hidden()
    told = [said.split(",")[0] for said in own_tab.evaluate("alerts")]
    met = "The right elbow met something"
    assert [said[: len(met)] for said in told[1:]] == [met, met]


@pytest.mark.parametrize("where", ["/face", "/"])
def test_what_says_that_help_is_near_covers_no_field_names_no_violence_and_can_be_hidden(
    own_tab: Page, url: str, where: str
) -> None:
    heard, now = itertools.count(), dict[str, Any]()

    def hear(kind: str) -> None:
        now["distress"] = {"number": next(heard), "time": 1.0, "kind": kind, "words": None}

    hear("breathing")
    see(own_tab, now)
    own_tab.set_viewport_size(SMALL)
    own_tab.goto(url + where)
    banner, line = own_tab.locator(".need"), own_tab.get_by_label("Say something to it")
    expect(banner).to_contain_text("trouble breathing")
    if where == "/face":
        own_tab.get_by_text("Say something", exact=True).click()
    line.focus()
    boxes = [
        each.bounding_box()
        for each in (banner, line, own_tab.get_by_role("button", name="Say", exact=True))
    ]
    over, *fields = [box for box in boxes if box is not None]
    assert [over["y"] + over["height"] <= field["y"] for field in fields] == [True, True]
    hear("abuse")
    expect(banner).to_contain_text("For help, call your local emergency number.")
    assert not re.search("violence|abuse", own_tab.inner_text("body"))
    banner.get_by_role("button", name="Hide").click()
    expect(banner).to_be_hidden()
    own_tab.reload()
    own_tab.wait_for_function("document.documentElement.dataset.connected === 'true'")
    expect(banner).to_be_hidden()
    hear("suicide")
    expect(banner).to_contain_text("For help, call")


def test_the_face_says_that_it_is_paused_and_why_it_is_stopped(face: Page) -> None:
    ask(face, "/pause", paused=True)
    expect(face.locator("#now")).to_have_text("Paused")
    ask(face, "/stop")
    expect(face.locator("#now")).to_have_text("Stopped")
    expect(face.get_by_text("Somebody pressed Stop.")).to_be_in_viewport(ratio=1)


LONG = {
    "#stop .reached": "Sofort anhalten",
    "#release": "Bewegungsfreigabe",
    "#studio": "Bedienungsoberfläche",
    "#now": "Zwischenzeitlich angehalten",
}


@pytest.mark.parametrize("size", [SMALL, ViewportSize(width=740, height=360)])
def test_no_corner_of_the_face_covers_another_however_long_its_words(
    face: Page, size: ViewportSize
) -> None:
    face.set_viewport_size(size)
    ask(face, "/stop")
    expect(face.locator("#now")).to_have_text("Stopped")
    for place, text in LONG.items():
        face.locator(place).evaluate("(one, text) => { one.textContent = text; }", text)
    boxes = []
    for place in ("#stop", "#release", "#now", "#talk", "#studio", ".senses"):
        corner = face.locator(place)
        expect(corner).to_be_in_viewport(ratio=1)
        if place != "#studio":  # which may be cut short
            assert corner.evaluate("one => one.scrollWidth <= one.clientWidth")
        box = corner.bounding_box()
        assert box is not None
        boxes.append(box)
    for one, other in itertools.combinations(boxes, 2):
        beside = max(one["x"], other["x"]) >= min(
            one["x"] + one["width"], other["x"] + other["width"]
        )
        above = max(one["y"], other["y"]) >= min(
            one["y"] + one["height"], other["y"] + other["height"]
        )
        assert beside or above, (one, other)


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
            # Chromium left bold text as boxes where the font was a last resort and came late.
            expect(page.locator(stop)).to_have_css("font-family", re.compile('^"Miburi Japanese"'))
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
