"""The face is stroked, patted, poked; the phone is lifted, shaken, knocked and dropped."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser, BrowserContext, CDPSession, Page, Route, expect
from tests.fixtures.browser import PATIENCE, ask, needs_browser

pytestmark = needs_browser

#: The partner under a name by which no browser trusts it.
FAR = "http://partner.test"
#: A phone's readings a second.
RATE = 60
Array = NDArray[np.float64]


@pytest.fixture
def phone(browser: Browser, url: str) -> Iterator[Page]:
    context = browser.new_context(viewport={"width": 390, "height": 780}, has_touch=True)
    context.set_default_timeout(PATIENCE)
    page = context.new_page()
    page.goto(url + "/face")
    page.wait_for_function("document.documentElement.dataset.connected === 'true'")
    yield page
    context.close()


def senses(page: Page) -> list[dict[str, Any]]:
    """Collect what the page says that happened."""
    sent: list[dict[str, Any]] = []
    page.on("request", lambda r: r.url.endswith("/sense") and sent.append(r.post_data_json))
    return sent


def draw(page: Page, way: float) -> None:
    """Draw a finger over the cheek in ten steps, or tap."""
    devtools = page.context.new_cdp_session(page)

    def touch(kind: str, *xs: float) -> None:
        points = [{"x": x, "y": 420} for x in xs]
        devtools.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    touch("touchStart", 60)
    for step in range(1, 11) if way else ():
        page.wait_for_timeout(40)
        touch("touchMove", 60 + way * step / 10)
    touch("touchEnd")


def test_a_stroke_of_the_face_pleases(phone: Page) -> None:
    sent = senses(phone)
    draw(phone, 300)
    expect(phone.locator("#now")).to_have_text("happiness")
    assert sent == [{"kind": "stroke"}]


@pytest.mark.parametrize(
    ("way", "seconds", "kinds"),
    [(250, 0.6, ["stroke"]), (1000, 2.0, ["stroke"]), (250, 0.05, []), (250, 4.0, []),
     (60, 0.3, []), (8, 0.1, ["pat"]), (0, 1.0, ["hold"])],
    ids=["a stroke", "a long one", "a flick", "too slow", "too short", "a tap", "a long press"],
)  # fmt: skip
def test_the_way_of_a_finger_gets_its_name(
    workbench: Page, way: float, seconds: float, kinds: list[str]
) -> None:
    found = workbench.evaluate(
        """async ([way, seconds]) => {
          const { Touch } = await import("/static/touch.js"), touch = new Touch();
          const found = [touch.down(10, 10, 0)];
          for (let k = 0.05; k < 1.01; k += 0.05)
            found.push(touch.move(10 + way * k, 10, 1000 * seconds * k));
          return [...found, touch.up(1000 * seconds)].filter((kind) => kind);
        }""",
        [way, seconds],
    )
    assert found == kinds


def test_patting_pleases_and_poking_angers(phone: Page) -> None:
    sent = senses(phone)
    draw(phone, 0)
    phone.wait_for_timeout(2100)
    # Eight presses within 2 s, however busy this computer is.
    phone.evaluate("for (let i = 0; i < 8; i++) document.getElementById('face').click()")
    expect(phone.locator("#now")).to_have_text("anger")
    assert [one["kind"] for one in sent] == ["pat"] * 6 + ["poke"] * 3
    assert all(one.keys() == {"kind"} for one in sent), "a name goes, and nothing else"


def test_the_face_is_patted_by_keyboard(context: BrowserContext, url: str) -> None:
    page = context.new_page()
    page.goto(url + "/face")
    sent = senses(page)
    page.locator("#face").focus()
    with page.expect_request("**/sense"):
        page.keyboard.press("Enter")
    page.wait_for_timeout(150)  # another would have come
    assert sent == [{"kind": "pat"}]


def recording(seconds: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """A phone that lies still, a little noisy: its own acceleration, and gravity, (n, 3) m/s²."""
    n = round(seconds * RATE)
    return rng.normal(0, 0.1, (n, 3)), np.tile([0.0, 2.5, 9.5], (n, 1))


def spike(rng: np.random.Generator, force: float) -> tuple[Array, Array]:
    own, down = recording(1.5, rng)
    own[40, 2] += force
    own[41, 2] -= force / 4
    return own, down


def shake(
    rng: np.random.Generator, force: float, seconds: float, hertz: float = 4.0
) -> tuple[Array, Array]:
    own, down = recording(seconds + 1, rng)
    t = np.arange(round(seconds * RATE)) / RATE
    own[30 : 30 + len(t), 0] += force * np.sin(2 * np.pi * hertz * t)
    return own, down


def turn(rng: np.random.Generator, degrees: float, seconds: float) -> tuple[Array, Array]:
    own, down = recording(seconds + 1, rng)
    angle = np.radians(np.clip((np.arange(len(down)) / RATE - 0.5) / seconds, 0, 1) * degrees)
    down[:] = 9.8 * np.column_stack([np.sin(angle), 0.25 * np.ones_like(angle), np.cos(angle)])
    return own, down


def fall(rng: np.random.Generator, seconds: float) -> tuple[Array, Array]:
    own, down = recording(1.5, rng)
    n = round(seconds * RATE)
    own[40 : 40 + n] -= down[40 : 40 + n]
    own[40 + n] += [0, 0, 40]
    return own, down


@pytest.mark.parametrize(
    ("made", "kinds"),
    [
        (lambda rng: recording(3, rng), []),
        (lambda rng: spike(rng, rng.uniform(24, 60)), ["knock"]),
        (lambda rng: spike(rng, 14), []),
        (lambda rng: shake(rng, rng.uniform(16, 30), 1.0), ["shake"]),
        (lambda rng: shake(rng, rng.uniform(3, 9), 2.0), []),
        (lambda rng: shake(rng, 20, 4.2), ["shake", "shake", "shake_on"]),
        (lambda rng: turn(rng, rng.uniform(40, 90), 0.7), ["lift"]),
        (lambda rng: turn(rng, 40, 6.0), []),
        (lambda rng: fall(rng, rng.uniform(0.25, 0.4)), ["drop"]),
        (lambda rng: fall(rng, 0.1), []),
    ],
    ids=["still", "knock", "a soft knock", "shake", "a ride", "shaken on", "lifted", "leaning",
         "dropped", "a slip"],
)  # fmt: skip
def test_what_the_sensors_say_gets_its_name(
    workbench: Page, made: Callable[[np.random.Generator], tuple[Array, Array]], kinds: list[str]
) -> None:
    found = []
    for seed in range(10):
        own, down = made(np.random.default_rng(seed))
        found.append(noticed(workbench, own, own + down))
    assert found == [kinds] * 10


def noticed(page: Page, own: Array, whole: Array, moved: float = 1e9) -> list[str]:
    """What motion.js makes of a recording, if the partner moves at ``moved`` s."""
    names: list[str] = page.evaluate(
        """async ([own, whole, rate, moved]) => {
          const { Motion } = await import("/static/motion.js"), motion = new Motion(), names = [];
          own.forEach((one, i) => {
            const time = 1000 + (1000 * i) / rate;
            if (time - 1000 >= 1000 * moved && time - 1000 < 1000 * moved + 50) motion.moved(time);
            names.push(motion.take(one, whole[i], time));
          });
          return names.filter((name) => name);
        }""",
        [own.tolist(), whole.tolist(), RATE, moved],
    )
    return names


def test_what_the_partners_own_motion_does_to_the_phone_is_no_touch(workbench: Page) -> None:
    """A spike at 0.67 s: none if the partner moved within 0.3 s before it, or just after it."""
    own, down = spike(np.random.default_rng(1), 40)
    for moved, kinds in ((0.2, ["knock"]), (0.45, []), (0.66, []), (0.8, [])):
        assert noticed(workbench, own, own + down, moved) == kinds, moved


def sensors(devtools: CDPSession, name: str, x: float, y: float, z: float) -> None:
    reading = {"type": name, "reading": {"xyz": {"x": x, "y": y, "z": z}}}
    devtools.send("Emulation.setSensorOverrideReadings", reading)


def test_a_phone_that_is_lifted_tells_its_partner(phone: Page) -> None:
    """Chromium's own sensors: they are turned, and the partner is surprised."""
    ask(phone, "/pause", paused=True)  # or its own gestures would be ignored
    sent = senses(phone)
    devtools = phone.context.new_cdp_session(phone)
    for name in ("accelerometer", "linear-acceleration", "gyroscope"):
        devtools.send("Emulation.setSensorOverrideEnabled", {"enabled": True, "type": name})
    sensors(devtools, "linear-acceleration", 0, 0, 0)
    sensors(devtools, "gyroscope", 0, 0, 0)
    sensors(devtools, "accelerometer", 0, 0, 9.8)
    phone.wait_for_function("document.documentElement.dataset.phase === 'idle'")
    phone.locator(".senses summary").click()
    phone.get_by_role("switch", name="Motion").click()
    expect(phone.locator("html")).to_have_attribute("data-motion", "on")
    phone.evaluate("window.readings = 0; ondevicemotion = () => window.readings++")
    phone.wait_for_function(f"window.readings > {0.7 * RATE}")
    sensors(devtools, "accelerometer", 9.8, 0, 0)
    phone.wait_for_function("document.querySelector('#now').textContent === 'surprise'")
    assert sent == [{"kind": "lift"}]
    ask(phone, "/pause", paused=False)


def test_a_page_that_is_not_secure_says_why_it_feels_no_motion(browser: Browser, url: str) -> None:
    page = browser.new_context().new_page()

    def serve(route: Route) -> None:
        known = {**route.request.headers, "origin": url}
        route.fulfill(response=route.fetch(url=route.request.url.replace(FAR, url), headers=known))

    page.route(FAR + "/**", serve)
    page.goto(FAR + "/face")
    assert page.evaluate("window.isSecureContext") is False
    page.evaluate("document.querySelector('.senses').open = true")
    expect(page.get_by_role("switch", name="Motion", include_hidden=True)).to_be_disabled()
    expect(page.locator("#about-motion")).to_contain_text("https")
    expect(page.get_by_role("switch", name="Voice", include_hidden=True)).to_be_enabled()
    page.context.close()
