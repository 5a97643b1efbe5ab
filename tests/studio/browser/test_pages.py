"""The pages in a real browser: what a person sees and does."""

import itertools
import json
import math
import re
from base64 import b64encode
from importlib import resources
from pathlib import Path
from typing import Any
from urllib.parse import urljoin

import numpy as np
import pytest
from playwright.sync_api import Browser, BrowserContext, Page, Route, expect
from tests.fixtures.browser import (
    ask,
    hand_has_come,
    needs_browser,
    on_screen,
    open_studio,
    press_above,
    release,
    release_by_key,
    see,
    settled_on_screen,
    state,
    until,
    visiting,
)
from tests.fixtures.program import address, started

from miburi.feelings.catalogue import load_catalogue

PRIDE = """
[[feeling]]
name = "pride"
words = { en = "pride", ja = "誇り" }
colour = { paper = "#8a5a2b", screen = "#b9783a" }
[feeling.face]
tint = "#f0c9a0"
eyes = { open = 0.62, cheek = 0.35 }
mouth = { smile = 14 }
"""

pytestmark = needs_browser


def made_happy(page: Page) -> None:
    """Wait for a happy mood that has stopped rising: from here on only a contact lowers it."""
    for source in itertools.cycle(("speech", "face", "touch")):
        ask(page, "/stimulus", feeling="happiness", strength=1.0, source=source)
        now = until(page, lambda now: now["emotion"][0] < 0.7)
        if now["mood"][0] > 0.4:
            break
    until(page, lambda now: now["feeling"][0] < now["mood"][0])


def has_ended(page: Page, wish: str) -> bool:
    """Whether a wish's gesture is over, whole or not."""
    entries = page.request.get(urljoin(page.url, "/api/v1/log")).json()
    ends = {"gesture_ended", "gesture_broken_off", "wish_dropped"}
    return any(entry["kind"] in ends and entry["wish"] == wish for entry in entries)


def test_a_press_is_felt_shown_and_remembered(studio: Page, context: BrowserContext) -> None:
    face = context.new_page()
    face.goto(urljoin(studio.url, "/face"))
    before = until(studio, lambda now: now["felt"] is None or now["emotion"][0] < 0.5)
    drawn = face.locator("svg path").first.get_attribute("d")
    studio.locator("[data-feeling=happiness]").click()
    until(studio, lambda now: now["emotion"][0] > 0.5)
    until(
        studio,
        lambda now: (
            now["hand_speed"] > 0.05
            and now["expressed"]
            and now["expressed"]["feeling"] == "happiness"
        ),
    )
    until(studio, lambda now: now["mood"][0] > before["mood"][0] + 0.005)
    bar = "document.querySelector('[data-feeling=happiness] .bar.mood i').style.transform"
    shown = "Number(/scaleX\\(([.\\d]+)/.exec(" + bar + ")[1])"
    studio.wait_for_function(f"{shown} > {before['mood'][0] + 0.004}")
    expect(studio.locator(".log")).to_contain_text("A remark: happiness, strength 0.70")
    assert face.locator("svg path").first.get_attribute("d") != drawn
    expect(face.locator("#now")).to_have_text("happiness")
    # The page is busy between the press and the release, but the press itself was short.
    studio.evaluate(
        "() => document.addEventListener('pointerdown', () => {"
        " for (const from = performance.now(); performance.now() < from + 1500;); },"
        " { once: true })"
    )
    with studio.expect_request("**/stimulus") as told:
        studio.locator("[data-feeling=happiness]").click()
    assert told.value.post_data_json["strength"] == 0.7


def test_the_scene_is_drawn_as_it_should_be(page: Page, url: str) -> None:
    """Also on a busy device, where the time of every frame is two seconds old."""
    corners = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0, 0.1]], "<f4")
    packed = [b64encode(one.tobytes()).decode() for one in (corners, np.array([0, 1, 2], "<u4"))]
    shape = {"link": "torso", "colour": [1, 0, 0, 1], "points": packed[0], "faces": packed[1]}
    page.route("**/api/page/shapes", lambda route: route.fulfill(json=[shape]))
    with page.add_init_script(
        "const real = requestAnimationFrame;"
        "window.requestAnimationFrame = (draw) => real((now) => draw(now - 2000));"
    ):
        open_studio(page, url + "/?quality=low")
    page.wait_for_function("document.querySelector('.robot-view')?.view?.dressed")
    drawn = page.evaluate(
        "() => document.querySelector('.robot-view').view.meshes.filter((one) => one.visible)"
        ".map((one) => [one.userData.link, one.userData.phone ?? false,"
        " one.geometry.attributes.position.count])"
    )
    assert drawn[-1] == ["torso", False, 3], "printed shapes take the place of simple ones"
    assert len(drawn) > 1
    assert all(phone for _, phone, _ in drawn[:-1])
    angles = page.evaluate(
        """async () => {
          const { view } = document.querySelector('.robot-view');
          const seen = [];
          for (let i = 0; i < 20; i++) {
            await new Promise((go) => setTimeout(go, 50));
            seen.push(...view.angles);
          }
          return seen;
        }"""
    )
    assert max(abs(angle) for angle in angles) < 3.2, "no impossible robot"
    nameless = page.evaluate(
        """() => [...document.querySelectorAll('button, input, select, canvas, [role=img], a')]
          .filter((e) => e.offsetParent && !(e.textContent.trim() || e.ariaLabel || e.title ||
            e.getAttribute('aria-label') || e.labels?.length || e.closest('[aria-label]')))
          .map((e) => e.outerHTML.slice(0, 120))"""
    )
    assert nameless == []


def test_a_dragged_hand_stops_the_robot_and_release_lets_it_go_on(scene: Page) -> None:
    made_happy(scene)
    scene.get_by_role("button", name="Got it").click()  # else the hint moves the low scene down
    scene.get_by_role("button", name="Reach in").click()
    before = until(scene, hand_has_come)
    origin = urljoin(scene.url, "/").rstrip("/")
    scene.mouse.move(*settled_on_screen(scene, before["hand"]["position"]))
    scene.mouse.down()
    # Round the robot, as one would: straight across its picture the pointer passes over the other
    # arm, the hand goes as deep as that, and from there the trunk is in its way.
    scene.mouse.move(*on_screen(scene, [0.22, -0.2, 0.1]))
    until(scene, lambda now: now["hand"]["position"][1] < -0.05)
    scene.mouse.move(*on_screen(scene, [0.05, -0.17, 0.17]))
    wide = {"feeling": "happiness", "mood": 1.0}

    def met(now: dict[str, Any]) -> bool:
        """Whether it met the hand in a gesture, not on its way back from where a late loop was."""
        stop = now["stop"]
        return bool(stop) and stop["reason"] == "contact" and stop["mood_before"] > 0

    for _ in range(10):
        wish = scene.request.post(origin + "/api/v1/express", data=wide).json()["id"]
        # A stop of another reason may break it off before it can be seen to move.
        now = until(scene, lambda now, wish=wish: met(now) or has_ended(scene, wish))
        if met(now):
            break
    assert now["stop"]["reason"] == "contact"
    scene.request.post(origin + "/api/v1/stop")  # it waits for us now
    stop = state(scene)["stop"]
    assert stop["mood_after"] == pytest.approx(0.8 * stop["mood_before"], rel=1e-3)
    joint = {"waist": "waist"}.get(stop["motor"], stop["motor"].replace("_", " "))
    expect(scene.locator(".why")).to_contain_text(f"The {joint} met something")
    expect(scene.locator(".facts")).to_contain_text("−20 %")
    expect(scene.locator(".log")).to_contain_text(f"Stopped: the {joint}")
    if stop["expected"] is not None:  # it may have met the hand again on its way back
        expect(scene.locator(".facts")).to_contain_text(f"{math.degrees(stop['expected']):.0f} °/s")
    scene.mouse.up()
    scene.get_by_role("button", name="Take the hand away").click()
    until(scene, lambda now: not now["hand_out"])
    scene.get_by_role("button", name="Release", exact=True).click()
    until(scene, lambda now: now["phase"] != "stopped")
    until(scene, lambda now: now["phase"] == "idle" or now["expressed"])
    expect(scene.locator(".facts")).to_contain_text("−20 %")  # it can still be read


def test_stop_by_key_holds_and_acts_over_an_open_dialog_with_one_press(
    studio: Page, context: BrowserContext
) -> None:
    face = context.new_page()
    face.goto(urljoin(studio.url, "/face"))
    studio.locator("[data-feeling=thrill]").click()
    face.wait_for_function("document.documentElement.dataset.phase === 'moving'")
    face.evaluate(
        "document.body.dispatchEvent(new KeyboardEvent('keydown', {key: 'Escape', bubbles: true}))"
    )
    now = until(face, lambda now: now["stop"])
    assert now["stop"]["reason"] == "asked"
    expect(studio.locator(".pill")).to_have_text("Stopped")
    studio.reload()
    expect(studio.locator(".pill")).to_have_text("Stopped")
    expect(studio.locator(".why")).to_contain_text("Somebody pressed Stop")
    expect(studio.locator(".log")).to_contain_text("Stop was pressed by a person")
    release_by_key(studio)
    dialog, stop = studio.locator(".q-dialog .card"), studio.locator(".stop-button")
    close = dialog.get_by_role("button", name="Close")
    for press, leave in (
        (stop.click, close.click),
        (lambda: studio.keyboard.press("Escape"), lambda: None),
    ):
        press_above(studio, "Face")
        expect(dialog).to_be_visible()
        press()
        until(studio, lambda now: now["phase"] == "stopped")
        leave()
        expect(dialog).to_be_hidden()
        studio.locator(".release-button").click()
        until(studio, lambda now: now["phase"] != "stopped")


@pytest.mark.parametrize("where", ["/privacy", "/people", "/mistyped"])
def test_a_page_to_read_stops_the_robot_too(browser: Browser, url: str, where: str) -> None:
    with visiting(browser) as context:
        page = context.new_page()
        page.goto(url + where)
        stop = page.get_by_role("button", name="Stop", exact=True)
        for press in (stop.click, lambda: page.keyboard.press("Escape")):
            expect(stop).to_be_in_viewport(ratio=1)
            press()
            until(page, lambda now: now["held"])
            expect(page.get_by_role("banner")).to_contain_text("Stopped")
            release(page)
            expect(page.get_by_role("banner")).not_to_contain_text("Stopped")


def test_the_studio_announces_what_is_felt_and_no_moves(own_tab: Page, url: str) -> None:
    see(own_tab, now := {"phase": "idle", "felt": None, "expressed": None, "stop": None})
    open_studio(own_tab, url)
    own_tab.evaluate(
        "() => { window.told = []; new MutationObserver((changes) => { for (const { target } of"
        " changes) { const live = target.closest?.('[role=status], [aria-live], output');"
        " if (live?.textContent) told.push(live.textContent); } })"
        ".observe(document.body, { childList: true, subtree: true }); }"
    )
    for feeling in ("sadness", "anger"):
        for phase in ("moving", "idle", "moving"):
            now.update(phase=phase, felt={"feeling": feeling, "mood": 0.5})
            own_tab.wait_for_function(f"document.documentElement.dataset.phase === '{phase}'")
        expect(own_tab.get_by_role("status").get_by_text(feeling)).to_be_visible()
    assert own_tab.evaluate("told") == ["sadness", "anger"]


@pytest.mark.parametrize("where", ["/", "/face"])
def test_without_javascript_a_page_says_that_its_stop_does_not_work(
    browser: Browser, url: str, where: str
) -> None:
    with visiting(browser, java_script_enabled=False) as context:
        page = context.new_page()
        page.goto(url + where)
        said = page.locator("noscript p")
        expect(said).to_be_visible()
        expect(said).to_contain_text("Stop does not work without it")
        expect(page.get_by_role("button")).to_have_count(0)


def test_a_visitors_settings_are_remembered(studio: Page) -> None:
    hint = studio.get_by_text("New here?")
    expect(hint).to_be_visible()
    studio.get_by_role("button", name="Got it").click()
    expect(hint).to_be_hidden()
    studio.get_by_role("button", name="Light or dark").click()
    studio.get_by_role("button", name="Pause").click()
    expect(studio.locator("header")).to_contain_text("Resume")  # the page has changed since
    studio.wait_for_function("document.body.classList.contains('body--dark')")
    studio.get_by_role("tab", name="Body").click()
    slider = studio.get_by_role("slider")
    slider.locator("[tabindex]").focus()
    studio.keyboard.press("ArrowLeft")
    expect(slider).to_have_attribute("aria-valuenow", "0.65")
    studio.get_by_label("Language").select_option("日本語")
    expect(studio.get_by_role("button", name="停止")).to_be_visible()
    studio.reload()
    expect(studio.get_by_role("button", name="停止")).to_be_visible()
    studio.wait_for_function(
        "window.did_handshake && document.body.classList.contains('body--dark')"
    )
    assert studio.locator("html").get_attribute("lang") == "ja"
    expect(studio.locator(".first")).to_have_count(0)
    expect(studio.get_by_role("tab", name="体")).to_have_attribute("aria-selected", "true")
    expect(slider).to_have_attribute("aria-valuenow", "0.65")
    with studio.expect_request("**/stimulus") as told:
        studio.locator("[data-feeling=anger]").click()
    assert told.value.post_data_json["strength"] == 0.65


@pytest.mark.proof("test_panels_do_what_they_say")
def test_another_body_is_connected_from_the_page(studio: Page, firmware: Path) -> None:
    studio.get_by_role("tab", name="Body").click()
    expect(studio.locator(".motors")).to_contain_text("right elbow")
    expect(studio.locator(".motors")).not_to_contain_text("°C")
    studio.get_by_label("Body", exact=True).select_option("Card on a port")
    expect(studio.get_by_label("Port")).to_be_visible()
    studio.get_by_label("Port").fill("/dev/no-such-port")
    studio.get_by_role("button", name="Connect").click()
    expect(studio.locator(".q-notification")).to_contain_text("is not a serial port")
    studio.get_by_label("Body", exact=True).select_option("Emulated card")
    studio.get_by_role("button", name="Connect").click()
    until(studio, lambda now: now["body"] == "emulated-card")
    expect(studio.locator(".motors")).to_contain_text("35 °C")
    expect(studio.locator(".motors")).to_contain_text("5.0 V")
    expect(studio.locator(".tabs-card")).to_contain_text("Not calibrated")
    ask(studio, "/bodies", name="simulated")
    expect(studio.locator(".motors")).not_to_contain_text("°C")
    expect(studio.get_by_label("Body", exact=True)).to_have_value("simulated")


def test_panels_do_what_they_say(studio: Page) -> None:
    studio.get_by_role("tab", name="Gestures").click()
    studio.get_by_role("button", name="Perform").click()
    until(studio, lambda now: now["asked"])
    studio.get_by_role("tab", name="Body").click()
    ask(studio, "/temperament", name="calm")  # another page or a program changes it
    expect(studio.get_by_label("Temperament")).to_have_value("calm")
    ask(studio, "/temperament", name="playful")
    studio.get_by_role("button", name="Record", exact=True).click()
    name = until(studio, lambda now: now["recording"])["recording"]
    studio.get_by_role("button", name="End recording").click()
    link = studio.get_by_role("link", name=name)
    expect(link).to_be_visible()
    studio.get_by_role("button", name=f"Delete {name}").click()
    delete = studio.get_by_role("button", name=f"Delete for good? {name}")
    expect(delete).to_be_visible()
    expect(link).to_be_visible()  # not at the first press
    studio.get_by_role("button", name="Record", exact=True).click()
    second = until(studio, lambda now: now["recording"])["recording"]
    studio.get_by_role("button", name="End recording").click()
    expect(studio.get_by_role("link", name=second)).to_be_visible()
    delete.click()  # the list has changed meanwhile; what was asked there has not
    expect(link).to_be_hidden()
    studio.get_by_role("button", name="Pause").click()
    until(studio, lambda now: now["paused"])
    studio.get_by_role("button", name="Resume").click()
    until(studio, lambda now: not now["paused"])
    studio.get_by_role("tab", name="Time").click()
    expect(studio.get_by_role("img", name="Measured ÷ commanded speed")).to_be_visible()
    alone = studio.locator(".plots figure").last.get_by_role("button", name="right elbow")
    alone.click()
    expect(alone).to_have_attribute("aria-pressed", "true")


def test_a_feeling_of_a_users_own_has_a_face(browser: Browser, url: str, tmp_path: Path) -> None:
    shipped = (resources.files("miburi.feelings") / "feelings.toml").read_text(encoding="utf-8")
    (tmp_path / "nine.toml").write_text(shipped + PRIDE)
    nine = load_catalogue(tmp_path / "nine.toml")

    def with_pride(route: Route) -> None:
        answer = route.fetch()
        before, words, after = re.split(r'(?<=id="words">)(.*)(?=</script>)', answer.text())
        more = json.dumps({**json.loads(words), "faces": nine.faces()})
        route.fulfill(response=answer, body=before + more + after)

    drawn = {}
    with visiting(browser) as context:  # a page that a test fulfils may not reach the partner
        page = context.new_page()
        page.route("**/face?*", with_pride)
        for shown in ("pride:1", "nothing:1"):
            page.goto(f"{url}/face?show={shown}&still")
            page.wait_for_function("Number(document.body.dataset.frames) > 2")
            drawn[shown] = (
                page.locator("#face").inner_html(),
                page.evaluate("document.body.style.background"),
            )
    assert "rgb(240, 201, 160)" in drawn["pride:1"][1]  # its tint
    assert drawn["pride:1"][0] != drawn["nothing:1"][0]


def test_the_face_says_when_it_is_alone_and_comes_back(own_tab: Page, url: str) -> None:
    lines: list[Any] = []

    def route(line: Any) -> None:
        if len(lines) != 1:
            line.connect_to_server()
        else:
            line.close()
        lines.append(line)

    own_tab.route_web_socket("**/api/v1/live*", route)
    own_tab.goto(url + "/face")
    own_tab.wait_for_function("document.documentElement.dataset.connected === 'true'")
    lines[0].close()
    expect(own_tab.locator(".lost")).to_be_visible()
    own_tab.wait_for_function("document.documentElement.dataset.connected === 'true'")
    expect(own_tab.locator(".lost")).to_be_hidden()
    before = state(own_tab)["emotion"][0]
    own_tab.locator("#face").click()
    until(own_tab, lambda now: now["emotion"][0] > max(0.2, before))
    until(own_tab, lambda now: now["phase"] != "stopped")  # a late loop stops it, too, for a while
    own_tab.locator("#stop").click()
    until(own_tab, lambda now: now["held"])
    own_tab.locator("#release").click()
    until(own_tab, lambda now: now["phase"] != "stopped")


def test_the_slower_copy_of_a_stop_undoes_no_release(own_tab: Page, url: str) -> None:
    """A page sends each press by its socket and by HTTP; here the socket is the slow way."""
    slow: list[Any] = []

    def route(line: Any) -> None:
        server = line.connect_to_server()
        line.on_message(lambda text: slow.append((server, text)) if "stop" in text else None)

    own_tab.route_web_socket("**/api/v1/live*", route)
    own_tab.goto(url + "/face")
    own_tab.wait_for_function("document.documentElement.dataset.connected === 'true'")
    own_tab.locator("#stop").click()
    until(own_tab, lambda now: now["held"])
    own_tab.locator("#release").click()
    until(own_tab, lambda now: not now["held"])
    [(server, text)] = slow
    server.send(text)
    then = state(own_tab)["time"]
    until(own_tab, lambda now: now["time"] > then + 1)
    assert not state(own_tab)["held"]


@pytest.mark.proof("test_a_press_is_felt_shown_and_remembered")
def test_the_program_itself_serves_a_browser(browser: Browser, tmp_path: Path) -> None:
    """With all its processes; other tests of pages have none between page and partner."""
    with started(tmp_path, "--forget") as said, visiting(browser) as context:
        page = context.new_page()
        open_studio(page, address(said))
        page.locator("[data-feeling=happiness]").click()
        until(page, lambda now: now["emotion"][0] > 0.5)
        page.locator(".stop-button").click()
        until(page, lambda now: now["held"])
        page.locator(".release-button").click()
        until(page, lambda now: not now["held"])
