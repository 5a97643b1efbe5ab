"""The partner's eyes in a real browser: what a face does to it, and what leaves the page."""

import io
from pathlib import Path

import pytest
from PIL import Image
from playwright.sync_api import Browser, BrowserContext, Page, expect
from tests.fixtures.browser import ask, fake_media, needs_browser, switch, until

pytestmark = needs_browser

#: A portrait by NASA: who it shows, smiles.
SMILE = Path(__file__).parents[2] / "fixtures" / "smile.jpg"
#: What look.js makes of [seconds, pitch, what the model says] parts, three pictures a second.
LOOK = """async (parts) => {
  const { Look } = await import("/static/look.js"), look = new Look(0), told = [];
  let time = 0;
  for (const [seconds, pitch, shows] of parts)
    for (const end = time + 1000 * seconds; time < end; ) {
      time += 333;
      for (const news of look.take(shows && { pitch, roll: 0, shows }, time)) told.push(news.kind);
    }
  return told;
}"""

#: Keeps in window.drawn what kinds of things are drawn on canvases.
WATCH_DRAWING = """() => {
  const { prototype } = CanvasRenderingContext2D, { drawImage } = prototype;
  window.drawn = new Set();
  prototype.drawImage = function (source, ...rest) {
    window.drawn.add(source.constructor.name);
    return drawImage.call(this, source, ...rest);
  };
}"""


def film(folder: Path, left: int) -> Path:
    """A second of pictures with the face at a place; a camera repeats it."""
    picture = Image.new("RGB", (320, 240), (120, 130, 140))
    picture.paste(Image.open(SMILE).resize((170, 170)), (left, 40))
    frame = io.BytesIO()
    picture.save(frame, "JPEG", quality=90)
    path = folder / "face.mjpeg"
    path.write_bytes(frame.getvalue() * 15)
    return path


def test_a_smile_makes_it_happy_its_arms_rise_and_it_looks_there(
    browser: Browser, url: str, tmp_path: Path
) -> None:
    asked: list[str] = []
    flag = f"--use-file-for-fake-video-capture={film(tmp_path, 10)}"
    with fake_media(browser, url, flag) as (page, sent):
        ask(page, "/stimulus", feeling="sadness", strength=1.0)
        until(page, lambda now: now["emotion"][0] < 0.3)
        page.on("request", lambda r: asked.append(r.url))
        switch(page, "Eyes", "Watching")
        page.wait_for_function("document.documentElement.dataset.faces === '1'")
        until(page, lambda now: now["emotion"][0] > 0.4)
        until(page, lambda now: (now["expressed"] or {}).get("feeling") == "happiness")
        until(page, lambda now: now["extent"] > 0.05)
        places = [one.pop("x") for one in sent if one.keys() == {"x"}]
        assert all(place < 0.45 for place in places)
        assert {one["kind"] for one in sent if one} == {"smile"}
        assert all(one.keys() == {"kind", "clearness"} for one in sent if one)
        assert all(one.startswith((url, "blob:" + url)) for one in asked)
        gaze = page.evaluate(
            "import('/static/face.js').then(({ gaze }) => gaze.at(performance.now()))"
        )
        assert gaze["right"] > 0.15, "the camera's left is the right of the partner's own face"
        with page.expect_request(lambda r: r.post_data_json == {"x": None}):
            switch(page, "Eyes", "Watching", on=False)


@pytest.mark.parametrize(
    ("loss", "drawn"),
    [("", False), ("delete window.VideoFrame", True),
     ("VideoFrame.prototype.allocationSize = () => 115200", True),
     ("Object.defineProperty(VideoFrame.prototype, 'rotation', { get: () => 90 })", True)],
    ids=["copies", "has no frames", "knows no form", "turned"],
)  # fmt: skip
def test_a_camera_s_pictures_are_copied_not_drawn_where_a_browser_can(
    browser: Browser, url: str, tmp_path: Path, loss: str, drawn: bool
) -> None:
    """What Chromium draws of a video it may keep: 0.3 MB a picture, a thousand pictures."""
    flag = f"--use-file-for-fake-video-capture={film(tmp_path, 75)}"
    with fake_media(browser, url, flag) as (page, _):
        page.evaluate(loss)
        page.evaluate(WATCH_DRAWING)
        switch(page, "Eyes", "Watching")
        page.wait_for_function("document.documentElement.dataset.faces === '1'")
        assert page.evaluate("window.drawn.has('HTMLVideoElement')") == drawn
        assert not page.evaluate("window.drawn.has('VideoFrame')")


@pytest.mark.parametrize(
    ("parts", "told"),
    [
        ([(5, 0.6, {"sad": 1.0})], []),
        ([(5, 0.1, {"sad": 1.0})], ["sad_face"]),
        ([(1.5, 0.1, {"sad": 1.0})], []),
        ([(5, 0.6, {"happy": 1.0})], ["smile", "smile"]),
        ([(0.3, 0, {"happy": 1.0}), (3, 0, {"neutral": 1.0})], []),
        ([(1, 0, {"happy": 1.0})], ["smile"]),
        ([(2, 0, {"happy": 1.0}), (2, 0, {"surprise": 1.0})], ["smile", "surprised_face"]),
        ([(5, 0, {"neutral": 1.0})], []),
        ([(61, 0, None), (1, 0, {"neutral": 1.0})], ["greet"]),
        ([(3, 0, {"neutral": 1.0}), (58, 0, None), (1, 0, {"neutral": 1.0})], []),
    ],
    ids=["turned down", "sad", "sad for a moment", "a smile, turned down", "a twitch",
         "a smile within a second",
         "a smile, then surprise", "nothing", "back after a minute", "back sooner"],
)  # fmt: skip
def test_what_a_face_shows_in_time(workbench: Page, parts: object, told: list[str]) -> None:
    assert workbench.evaluate(LOOK, parts) == told


def test_nothing_of_the_eyes_is_loaded_until_they_are_on(context: BrowserContext, url: str) -> None:
    page = context.new_page()
    page.goto(url + "/face")
    page.locator(".senses summary").click()
    expect(page.get_by_role("switch", name="Eyes")).not_to_be_checked()
    loaded = page.evaluate("performance.getEntriesByType('resource').map((one) => one.name)")
    assert not any(part in name for name in loaded for part in ("human", "eyes", "look.js"))
