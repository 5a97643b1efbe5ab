"""The face is stroked, patted, poked; the phone is lifted, shaken, knocked and dropped."""

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser, CDPSession, Page, Route, expect
from tests.fixtures.browser import ask, needs_browser, posts, until, visiting

from miburi.feelings import FEELINGS
from miburi.studio.words import page_languages, words

pytestmark = needs_browser

#: The partner under a name by which no browser trusts it.
FAR = "http://partner.test"
#: A phone's readings a second.
RATE = 60
Array = NDArray[np.float64]


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


def test_a_stroke_of_the_face_pleases_and_a_tap_or_a_key_is_a_pat(face: Page) -> None:
    sent = posts(face, "/sense")
    draw(face, 300)
    expect(face.locator("#now")).to_have_text("happiness")
    assert sent == [{"kind": "stroke"}]
    with face.expect_request("**/sense"):
        draw(face, 0)
    face.locator("#face").focus()
    with face.expect_request("**/sense"):
        face.keyboard.press("Enter")
    face.evaluate("new Promise((done) => setTimeout(done, 100))")  # another would have come
    pats = [{"kind": "pat"}] * 2
    assert sent == [{"kind": "stroke"}, *pats], "a name goes, and nothing else"


def test_the_way_of_a_finger_gets_its_name(workbench: Page) -> None:
    cases = {
        "a stroke": (250, 0.6, ["stroke"]), "a long one": (1000, 2.0, ["stroke"]),
        "a flick": (250, 0.05, []), "a slow one": (250, 4.0, ["stroke"]),
        "a quick one": (400, 0.15, ["stroke"]), "for ten seconds": (3000, 10.0, ["stroke"] * 5),
        "too short": (60, 0.3, []),
        "a tap": (8, 0.1, ["pat"]), "a long press": (0, 1.0, ["hold"]),
    }  # fmt: skip
    found = workbench.evaluate(
        """async (cases) => {
          const { Touch } = await import("/static/touch.js");
          return cases.map(([way, seconds]) => {
            const touch = new Touch(), found = [touch.down(10, 10, 0)];
            for (let k = 0.05; k < 1.01; k += 0.05)
              found.push(touch.move(10 + way * k, 10, 1000 * seconds * k));
            return [...found, touch.up(1000 * seconds)].filter((kind) => kind);
          });
        }""",
        [case[:2] for case in cases.values()],
    )
    assert dict(zip(cases, found, strict=True)) == {name: case[2] for name, case in cases.items()}


def test_patting_pleases_and_poking_angers(face: Page) -> None:
    sent = posts(face, "/sense")
    # Eight presses within 2 s, however busy this computer is.
    face.evaluate("for (let i = 0; i < 8; i++) document.getElementById('face').click()")
    expect(face.locator("#now")).to_have_text("anger")
    assert sent == [{"kind": "pat"}] * 5 + [{"kind": "poke"}] * 3


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


#: What is made of a phone's readings.
MOTIONS: dict[str, tuple[Callable[[np.random.Generator], tuple[Array, Array]], list[str]]] = {
    "still": (lambda rng: recording(3, rng), []),
    "knock": (lambda rng: spike(rng, rng.uniform(24, 60)), ["knock"]),
    "a soft knock": (lambda rng: spike(rng, 14), []),
    "shake": (lambda rng: shake(rng, rng.uniform(16, 30), 1.0), ["shake"]),
    "a ride": (lambda rng: shake(rng, rng.uniform(3, 9), 2.0), []),
    "shaken on": (lambda rng: shake(rng, 20, 4.2), ["shake", "shake", "shake_on"]),
    "lifted": (lambda rng: turn(rng, rng.uniform(40, 90), 0.7), ["lift"]),
    "leaning": (lambda rng: turn(rng, 40, 6.0), []),
    "dropped": (lambda rng: fall(rng, rng.uniform(0.25, 0.4)), ["drop"]),
    "a slip": (lambda rng: fall(rng, 0.1), []),
}


def test_what_the_sensors_say_gets_its_name(workbench: Page) -> None:
    wrong = []
    for name, (made, kinds) in MOTIONS.items():
        for seed in range(4):
            own, down = made(np.random.default_rng(seed))
            if (found := noticed(workbench, own, own + down)) != kinds:
                wrong.append((name, seed, found))
    assert wrong == []


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


@pytest.mark.proof("test_what_the_sensors_say_gets_its_name")
def test_a_phone_that_is_lifted_tells_its_partner(face: Page) -> None:
    """Chromium's own sensors: they are turned, and the partner is surprised."""
    ask(face, "/pause", paused=True)  # or its own gestures would be ignored
    sent = posts(face, "/sense")
    devtools = face.context.new_cdp_session(face)
    for name in ("accelerometer", "linear-acceleration", "gyroscope"):
        devtools.send("Emulation.setSensorOverrideEnabled", {"enabled": True, "type": name})
    sensors(devtools, "linear-acceleration", 0, 0, 0)
    sensors(devtools, "gyroscope", 0, 0, 0)
    sensors(devtools, "accelerometer", 0, 0, 9.8)
    face.wait_for_function("document.documentElement.dataset.phase === 'idle'")
    face.locator(".senses summary").click()
    face.get_by_role("switch", name="Motion").click()
    expect(face.locator("html")).to_have_attribute("data-motion", "on")
    face.evaluate("window.readings = 0; ondevicemotion = () => window.readings++")
    face.wait_for_function(f"window.readings > {0.7 * RATE}")
    turns = itertools.cycle([(9.8, 0, 0), (0, 0, 9.8)])

    def turned(now: dict[str, Any]) -> bool:
        """Turn it to and fro: where the browser stands still for a second, one turn is missed."""
        sensors(devtools, "accelerometer", *next(turns))
        face.wait_for_timeout(300)
        return bool(sent) and now["emotion"][FEELINGS.index("surprise")] > 0

    until(face, turned)
    assert sent[0] == {"kind": "lift"}
    devtools.detach()


def test_what_a_page_that_is_not_secure_cannot_do_is_grey_and_says_why(
    browser: Browser, url: str
) -> None:
    """As on a phone that came by plain http."""

    def serve(route: Route) -> None:
        known = {**route.request.headers, "origin": url}
        route.fulfill(response=route.fetch(url=route.request.url.replace(FAR, url), headers=known))

    with visiting(browser) as context:
        page = context.new_page()
        page.route(FAR + "/**", serve)
        for language in page_languages():
            page.goto(f"{FAR}/face?lang={language}")
            assert page.evaluate("window.isSecureContext") is False
            page.evaluate("document.querySelector('.senses').open = true")
            for name in ("motion", "ears", "eyes"):
                expect(page.locator(f"[data-sense={name}]")).to_be_disabled()
                about = page.locator(f"#about-{name}")
                expect(about).to_have_text(words(language)["sense_refused"]["insecure"])
            expect(page.locator("[data-sense=voice]")).to_be_enabled()
