"""A study from consent to withdrawal by keyboard alone; axe-core judges every page on the way."""

import threading
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, expect
from starlette.testclient import TestClient
from tests.fixtures.browser import needs_browser, tab_to, violations, visiting
from tests.fixtures.live import serving
from tests.fixtures.study import TWO_FILMS, Lab

from miburi.errors import OutputError
from miburi.feelings import Expression
from miburi.robot import Robot
from miburi.studies.film import Scene, write_film
from miburi.studies.study import pages
from miburi.studies.study.films import FILMS, find_films
from miburi.studies.study.live import Ending, Showing
from miburi.studies.study.pages import make_app
from miburi.studies.study.store import Store

pytestmark = needs_browser

#: A film, a sheet of pictures, and a live gesture; every kind of question.
STUDY = (
    TWO_FILMS
    + """
[[question]]
name = "robot"
kind = "rating"
points = 7
ask = { en = "How did it seem?", ja = "どう見えましたか？" }

[[question.items]]
name = "warm"
low = { en = "cold", ja = "冷たい" }
high = { en = "warm", ja = "温かい" }

[[question.items]]
name = "clear"
low = { en = "hard to read", ja = "分かりにくい" }
high = { en = "easy to read", ja = "分かりやすい" }

[[show]]
feelings = ["anger"]
moods = [0.3]
live = true
"""
)
#: How to look at a page: light or dark, px. Two looks in each of two languages are enough: every
#: light meets every width and every language.
LIGHT, DARK, LAPTOP, PHONE = "light", "dark", (1280, 800), (390, 844)
LOOKS: dict[str, Any] = {
    "en": [(LIGHT, *LAPTOP), (DARK, *PHONE)],
    "ja": [(LIGHT, *PHONE), (DARK, *LAPTOP)],
}
#: Every element of a page, without its words.
ELEMENTS = "[...document.querySelectorAll('*')].map(e => e.tagName + e.className).join()"
#: What a page of a question is made of: a kind of question, and something to see.
KINDS = {".rating", ".options", "#answer"}
MEDIA = {"video", "img", "form[action$=perform]"}
WORDS = tomllib.loads((Path(pages.__file__).parent / "pages" / "words.toml").read_text("utf-8"))


class Stage:
    """A robot that is hindered in some ways, one after the other, and then shows its gesture."""

    def __init__(self, hindrances: list[Ending]) -> None:
        self.hindrances = list(hindrances)
        self.moving, self.go = threading.Event(), threading.Event()

    def __call__(self, _: Expression) -> Showing:
        if self.hindrances:
            return Showing(self.hindrances.pop(0), begun=False)
        self.moving.set()
        return Showing(Ending.WHOLE if self.go.wait(60) else Ending.BROKEN, begun=True)


class Walk:
    """Somebody with a keyboard, and what is wrong with the pages that they meet."""

    def __init__(self, page: Page, language: str) -> None:
        self.page, self.language = page, language
        self.words, self.looks = WORDS[language], LOOKS[language]
        self.found: list[str] = []
        self.judged: set[str] = set()

    def look(self, at: str) -> None:
        """Judge a page; axe-core judges pages that differ in words alone once."""
        elements = self.page.evaluate(ELEMENTS)
        for light, width, height in self.looks:
            self.page.emulate_media(color_scheme=light, reduced_motion="reduce")
            self.page.set_viewport_size({"width": width, "height": height})
            where = f"{at}, {light}, {width} px"
            if elements not in self.judged:
                self.found += violations(self.page, where)
            if self.page.evaluate("document.documentElement.scrollWidth > innerWidth"):
                self.found.append(f"{where}: wider than the screen")
        self.judged.add(elements)

    def press(self, word: str, key: str = "Enter") -> None:
        tab_to(self.page, self.words.get(word, word))
        self.page.keyboard.press(key)

    def follow(self, word: str) -> None:
        """Press a button or a link, and wait for the page that it leads to."""
        with self.page.expect_navigation():
            self.press(word)

    def see(self, notice: str) -> None:
        expect(self.page.locator("h1")).to_have_text(self.words[notice])
        self.look(notice)

    def forget(self) -> None:
        """Leave the page as it is, and let the browser send it: the server is to refuse it."""
        self.page.evaluate("document.querySelectorAll('form').forEach(f => f.noValidate = true)")
        self.follow(self.page.locator("form button").last.inner_text())
        expect(self.page.locator("[role=alert]")).to_be_visible()
        self.look("what is missing")

    def parts(self) -> set[str]:
        """Return what a page of a question is made of."""
        return {part for part in KINDS | MEDIA if self.page.locator(part).count()}

    def answer(self) -> None:
        """Answer the question that is asked, whatever its kind."""
        parts = self.parts()
        if ".rating" in parts:
            for _ in range(2):
                self.press("1", "ArrowRight")
        elif ".options" in parts:
            self.press(self.page.locator(".option").first.inner_text().strip(), "Space")
        else:
            self.press(self.page.locator("h1").inner_text(), "s")
        self.follow("onward")


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    with visiting(browser) as context:
        yield context.new_page()


@pytest.mark.proof("test_one_question_a_page_to_the_end")
@pytest.mark.parametrize("language", WORDS)
def test_a_whole_study_by_keyboard_has_no_violation(
    page: Page, language: str, robot: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab = Lab(tmp_path, STUDY)
    draw(robot, tmp_path / FILMS)
    told: list[Ending] = [ending for ending in Ending if ending is not Ending.WHOLE]
    stage = Stage([Ending.BROKEN, *told])  # the first is another participant's
    films = find_films(lab.study, tmp_path)
    # The clock stands: nobody's turn ends, and a rush of newcomers does not pass.
    lab.app = make_app(lab.study, lab.store, films, perform=stage, clock=lambda: 0.0)
    walk = Walk(page, language)
    with serving(lab.app) as url:
        home = url + lab.home
        page.goto(f"{home}?language={language}")
        walk.look("consent")
        walk.forget()
        walk.press("agree", "Space")
        walk.follow("begin")
        walk.follow("information")
        walk.look("information")
        walk.follow("back")
        known: set[str] = set()
        while page.locator("progress").count():
            if page.get_by_role("button", name=walk.words["show"], exact=True).count():
                watch_all(walk, stage, lab, told)
            parts = walk.parts()
            walk.look(" and ".join(sorted(parts)))
            if page.locator("#film-first:visible").count():
                walk.press("play")
                expect(page.locator("#film-first")).to_be_hidden()
            if parts - known - MEDIA:
                walk.forget()
            known |= parts
            walk.answer()
        assert known == KINDS | MEDIA
        walk.see("thanks")
        leave(walk, lab, monkeypatch)
        while httpx.post(home, data={"agree": "yes"}).status_code == 303:
            pass
        page.goto(f"{home}?language={language}")
        walk.press("agree", "Space")
        walk.follow("begin")
        walk.see("busy_title")
        lab.store.close()
        page.goto(f"{home}?language={language}")
        walk.see("closed_title")
    assert "\n".join(walk.found) == ""


@pytest.mark.parametrize("playable", [True, False])
def test_a_question_waits_until_its_film_was_started(
    page: Page, robot: Robot, tmp_path: Path, playable: bool
) -> None:
    lab = Lab(tmp_path, TWO_FILMS.replace('["fear", "fright"]', '["fear"]'))
    if playable:  # else the file holds no film
        write_film(
            robot, [Scene(np.zeros(8))] * 2, tmp_path / FILMS / "fear-0.9.mp4", size=(64, 64)
        )
    onward, first = page.locator("#onward"), page.locator("#film-first")
    failed = page.locator("#film-failed")
    with serving(lab.app) as url:
        page.goto(url + lab.home)
        page.locator("[name=agree]").check()
        page.locator("form button").last.click()
        page.locator(".option input").first.check()
        if playable:
            expect(first).to_be_visible()
            expect(onward).to_be_disabled()
            page.locator("#start").click()
        expect(first).to_be_hidden()
        expect(failed).to_be_visible(visible=not playable)
        onward.click()
        expect(page.locator("#answer")).to_be_visible()
        expect(onward).to_be_enabled()  # the same film: it need not be started again
    assert [pace.plays for pace in lab.store.paces().values()] == [1 if playable else 0]


def test_a_film_that_could_not_be_loaded_can_be_tried_again(
    page: Page, robot: Robot, tmp_path: Path
) -> None:
    lab = Lab(tmp_path, TWO_FILMS.replace('["fear", "fright"]', '["fear"]'))
    write_film(robot, [Scene(np.zeros(8))] * 2, tmp_path / FILMS / "fear-0.9.mp4", size=(64, 64))
    failed, start = page.locator("#film-failed"), page.locator("#start")
    page.route("**/film/*", lambda route: route.abort())
    with serving(lab.app) as url:
        page.goto(url + lab.home)
        page.locator("[name=agree]").check()
        page.locator("form button").last.click()
        expect(failed).to_have_text(WORDS["en"]["film_failed"])
        start.click()
        expect(failed).to_be_visible()
        expect(page.locator("#plays")).to_have_value("0")
        expect(start).to_have_text(WORDS["en"]["again"])
        page.unroute("**/film/*")
        start.click()
        expect(page.locator("#plays")).to_have_value("1")
        expect(failed).to_be_hidden()
        expect(start).to_have_text(WORDS["en"]["play_again"])


def draw(robot: Robot, films: Path) -> None:
    """Put a short film of fear, and a sheet of pictures of fright, where a study finds them."""
    for name in ("fear-0.9", "fright-0.9"):
        (films / f"{name}.mp4").unlink()
    write_film(robot, [Scene(np.zeros(8))] * 2, films / "fear-0.9.mp4", size=(64, 64))
    Image.new("RGB", (640, 480), "gray").save(films / "fright-0.9.sheet.png")


def watch_all(walk: Walk, stage: Stage, lab: Lab, told: list[Ending]) -> None:
    """See every reason why a gesture is not shown, and then the gesture."""
    walk.see("watch")
    other = begin_with_the_robot(lab)
    walk.follow("show")
    walk.see("taken_title")
    lab.post(other, "/next")
    for ending in told:
        walk.follow("again")
        walk.follow("show")
        walk.see(f"{ending}_title")
    walk.follow("again")
    walk.press("show")
    assert stage.moving.wait(60)
    second = Walk(walk.page.context.new_page(), walk.language)
    second.page.goto(walk.page.url)
    second.see("moving_title")
    walk.found += second.found
    second.page.close()
    stage.go.set()
    expect(walk.page.get_by_role("button", name=walk.words["show_again"])).to_be_visible()


def begin_with_the_robot(lab: Lab) -> TestClient:
    """Let others begin until one is to see the gesture first, and has asked for it."""
    while True:
        other = lab.begin()
        asked = other.post(f"{lab.home}/perform", follow_redirects=False)
        if asked.status_code != 303:  # else a film comes first
            return other


def leave(walk: Walk, lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    """Withdraw: with a code that nobody has, on a full disk, and in the end."""
    walk.follow("withdraw_title")
    walk.see("withdraw_title")
    code = walk.page.locator("#code")
    own = code.input_value()
    tab_to(walk.page, walk.words["code"])
    walk.page.keyboard.type("AAAA-AAAA")
    walk.follow("withdraw_do")
    expect(walk.page.locator("[role=alert]")).to_have_text(walk.words["withdraw_wrong"])
    walk.look("a wrong code")

    def full(_store: Store, _code: str) -> bool:
        raise OutputError("no space left on device")

    tab_to(walk.page, walk.words["code"])
    walk.page.keyboard.type(own)
    with monkeypatch.context() as disk:
        disk.setattr(Store, "withdraw", full)
        walk.follow("withdraw_do")
        walk.see("full_title")
    walk.follow("again")
    walk.follow("withdraw_title")
    walk.follow("withdraw_do")
    walk.see("withdrawn_title")
    assert lab.store.answers() == []
