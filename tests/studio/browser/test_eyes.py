"""The partner's eyes in a real browser: what a face does to it, and what leaves the page."""

import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page
from tests.fixtures.browser import ask, fake_media, needs_browser, posts, switch, until

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

#: Which face look.js takes in each of the pictures; a face is its place, and its width.
CHOICE = """async (pictures) => {
  const { Choice } = await import("/static/look.js"), choice = new Choice();
  const faces = (picture) => picture.map(([x, width]) => ({ x, y: 0.5, width }));
  return pictures.map((picture, i) => choice.take(faces(picture), 333 * i)?.x ?? null);
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


@pytest.fixture(scope="module")
def seeing(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """A page whose camera has the face at its left, all the time."""
    picture = Image.new("RGB", (320, 240), (120, 130, 140))
    picture.paste(Image.open(SMILE).resize((170, 170)), (10, 40))
    frame = io.BytesIO()
    picture.save(frame, "JPEG", quality=90)
    film = tmp_path_factory.mktemp("camera") / "face.mjpeg"
    film.write_bytes(frame.getvalue() * 15)
    with fake_media(browser, f"--use-file-for-fake-video-capture={film}") as page:
        yield page


def test_of_several_faces_it_keeps_to_one(studio: Page) -> None:
    one, other, nearer = [0.2, 0.2], [0.7, 0.21], [0.7, 0.4]

    def taken(*pictures: list[list[float]]) -> list[float | None]:
        chosen = studio.evaluate(CHOICE, list(pictures))
        assert isinstance(chosen, list)
        return chosen

    assert taken([], [one], [one, other]) == [None, 0.2, 0.2]
    assert taken([one, nearer]) == [0.7], "the nearest at first"
    assert taken([one], *([[one, other]] * 20))[-1] == 0.2, "a little nearer is no reason"
    changes = taken([one], *([[one, nearer]] * 8))
    assert changes == [0.2] * 5 + [0.2, 0.7, 0.7, 0.7], "much nearer is, after 1.5 s"
    blinks = [[one, nearer], [one, nearer], [one, other]] * 6
    assert set(taken([one], *blinks)) == {0.2}, "but not for a moment"
    assert taken([one], [other], [other], [one]) == [0.2, None, None, 0.2]
    assert taken([one], *([[other]] * 5))[-2:] == [0.7, 0.7], "or when it has gone"
    walks = [[[0.2 + 0.1 * step, 0.2], other] for step in range(4)]
    assert taken(*[walk[:1] for walk in walks]) == pytest.approx([0.2, 0.3, 0.4, 0.5])


@pytest.mark.proof("test_what_a_face_shows_in_time")
def test_a_smile_makes_it_happy_its_arms_rise_and_it_looks_there(seeing: Page, url: str) -> None:
    asked: list[str] = []
    sent = posts(seeing, "")
    seeing.goto(url + "/face")
    seeing.locator(".senses summary").click()
    ask(seeing, "/stimulus", feeling="sadness", strength=1.0)
    until(seeing, lambda now: now["emotion"][0] < 0.3)
    seeing.on("request", lambda one: asked.append(one.url))
    switch(seeing, "Eyes", "Watching")
    seeing.wait_for_function("document.documentElement.dataset.faces === '1'")
    until(seeing, lambda now: now["emotion"][0] > 0.4)
    until(seeing, lambda now: (now["expressed"] or {}).get("feeling") == "happiness")
    until(seeing, lambda now: now["extent"] > 0.05)
    told = [one for one in sent if one]
    places = [one.pop("x") for one in told if one.keys() == {"x"}]
    assert places
    assert all(place < 0.45 for place in places)
    assert {one["kind"] for one in told if one} == {"smile"}
    assert all(one.keys() == {"kind", "clearness"} for one in told if one)
    assert all(one.startswith((url, "blob:" + url)) for one in asked)
    gaze = seeing.evaluate(
        "import('/static/face.js').then(({ gaze }) => gaze.at(performance.now()))"
    )
    assert gaze["right"] > 0.15, "the camera's left is the right of the partner's own face"
    with seeing.expect_request(lambda one: one.post_data_json == {"x": None}):
        switch(seeing, "Eyes", "Watching", on=False)


#: What a browser may lack; whether pictures are drawn then; and what brings it back.
LOSSES = {
    "nothing": ("", False, ""),
    "frames": ("window.kept = VideoFrame; delete window.VideoFrame", True,
               "window.VideoFrame = kept"),
    "their form": ("window.kept = VideoFrame.prototype.allocationSize; "
                   "VideoFrame.prototype.allocationSize = () => 115200", True,
                   "VideoFrame.prototype.allocationSize = kept"),
    "their upright": ("Object.defineProperty(VideoFrame.prototype, 'rotation', "
                      "{ get: () => 90, configurable: true })", True,
                      "delete VideoFrame.prototype.rotation"),
    "nothing again": ("", False, ""),
}  # fmt: skip


@pytest.mark.proof("test_of_several_faces_it_keeps_to_one")
def test_a_camera_s_pictures_are_copied_not_drawn_where_a_browser_can(
    seeing: Page, url: str
) -> None:
    """What Chromium draws of a video it may keep: 0.3 MB a picture, a thousand pictures."""
    seeing.goto(url + "/face")
    seeing.locator(".senses summary").click()
    seeing.evaluate(WATCH_DRAWING)
    for lost, (loss, drawn, found) in LOSSES.items():
        seeing.evaluate(f"() => {{ {loss} }}")
        seeing.evaluate("drawn.clear(), delete document.documentElement.dataset.faces")
        switch(seeing, "Eyes", "Watching")
        seeing.wait_for_function("document.documentElement.dataset.faces === '1'")
        assert seeing.evaluate("drawn.has('HTMLVideoElement')") == drawn, lost
        assert not seeing.evaluate("drawn.has('VideoFrame')"), lost
        switch(seeing, "Eyes", "Watching", on=False)
        seeing.evaluate(f"() => {{ {found} }}")


def test_what_a_face_shows_in_time(workbench: Page) -> None:
    cases: dict[str, tuple[list[object], list[str]]] = {
        "turned down": ([(5, 0.6, {"sad": 1.0})], []),
        "sad": ([(5, 0.1, {"sad": 1.0})], ["sad_face"]),
        "sad for a moment": ([(1.5, 0.1, {"sad": 1.0})], []),
        "a smile, turned down": ([(5, 0.6, {"happy": 1.0})], ["smile", "smile"]),
        "a twitch": ([(0.3, 0, {"happy": 1.0}), (3, 0, {"neutral": 1.0})], []),
        "a smile within a second": ([(1, 0, {"happy": 1.0})], ["smile"]),
        "a smile, then surprise": (
            [(2, 0, {"happy": 1.0}), (2, 0, {"surprise": 1.0})],
            ["smile", "surprised_face"],
        ),
        "nothing": ([(5, 0, {"neutral": 1.0})], []),
        "back after a minute": ([(61, 0, None), (1, 0, {"neutral": 1.0})], ["greet"]),
        "back sooner": (
            [(3, 0, {"neutral": 1.0}), (58, 0, None), (1, 0, {"neutral": 1.0})],
            [],
        ),
    }
    told = {name: workbench.evaluate(LOOK, parts) for name, (parts, _) in cases.items()}
    assert told == {name: kinds for name, (_, kinds) in cases.items()}


def test_it_blinks_as_often_as_people_do_and_not_like_a_metronome(workbench: Page) -> None:
    """17 times a minute, 26 while talking; by a generator of a test's own."""
    times = workbench.evaluate(
        """async () => {
          const { Blinker } = await import("/static/face.js");
          return [false, true].map((talks) => {
            let seed = 1;
            const random = () => (seed = (seed * 48271) % 2147483647) / 2147483647;
            const blinker = new Blinker(random), found = [];
            for (let time = 0, shut = false; time < 3600; time += 1 / 60) {
              const now = blinker.at(time, talks) > 0;
              if (now && !shut) found.push(time);
              shut = now;
            }
            return found;
          });
        }"""
    )
    for found, minute in zip(times, (17, 26), strict=True):
        gaps = np.diff(found)
        assert len(found) / 60 == pytest.approx(minute, rel=0.05)
        assert gaps.std() / gaps.mean() > 0.4
