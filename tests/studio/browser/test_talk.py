"""A line typed to the partner, and what it says that it understood."""

import re
from urllib.parse import urljoin

import pytest
from playwright.sync_api import Page, expect
from tests.fixtures.browser import ask, needs_browser, open_studio, posts, until

pytestmark = needs_browser


def say(page: Page, text: str) -> str:
    """Type a line; return the answer."""
    line = page.get_by_label("Say something to it")
    line.fill(text)
    line.press("Enter")
    answer = page.locator(".talk output")
    expect(answer).not_to_have_text("…")
    expect(answer).not_to_be_empty()
    return answer.inner_text()


def test_it_attends_to_a_typing_person_and_looks_where_it_turns(studio: Page, url: str) -> None:
    """Its eyes go first, on the face as in the studio."""
    sent = posts(studio, "/attend")
    studio.get_by_label("Say something to it").press_sequentially("Good mor")
    until(studio, lambda now: now["attention"] == "listening")
    assert sent == [{"turn": "listening"}]
    studio.goto(urljoin(url, "/face"))
    ask(studio, "/look", at="left", seconds=1.0)
    studio.wait_for_function("import('/static/face.js').then(({ led }) => led.eyes[0] > 0.5)")
    until(studio, lambda now: not now["asked"] and now["phase"] == "idle")
    studio.wait_for_function(
        "import('/static/face.js').then(({ led }) => Math.abs(led.eyes[0]) < 0.1)"
    )


@pytest.mark.parametrize("place", ["/", "/face"])
def test_it_says_what_it_heard_and_why_and_what_it_feels(
    studio: Page, url: str, place: str
) -> None:
    page = studio
    if place == "/face":
        page.goto(urljoin(url, place))
        page.get_by_text("Say something", exact=True).click()
    page.set_viewport_size({"width": 1000 if place == "/" else 390, "height": 720})
    heard = say(page, "I am so sad today")
    expect(page.locator(".talk output")).to_be_in_viewport(ratio=1)
    assert heard.startswith("I heard sadness in “sad”")
    assert "% sure" in heard
    assert "Now I feel sadness" in heard
    until(page, lambda now: now["emotion"][1] > 0.1)
    page.get_by_text("What pointed to this feeling, and how strongly").first.click()
    assert re.search(r"“sad” \+\d+\.\d", page.locator(".talk details").inner_text())
    nothing = say(page, "The table has four legs")
    assert "heard no feeling in that" in nothing
    assert "Use a plain word" in nothing
    assert say(page, "How are you?").startswith("You asked how I feel. “")


def test_of_the_faces_panels_one_is_open_at_a_time(face: Page) -> None:
    page = face
    page.get_by_text("Say something", exact=True).click()
    line, switch = page.get_by_label("Say something to it"), page.get_by_role("switch").first
    expect(line).to_be_visible()
    page.get_by_text("Voice and senses").click()
    expect(switch).to_be_visible()
    expect(line).to_be_hidden()


def test_what_watches_or_listens_is_told_beside_stop(studio: Page) -> None:
    page = studio
    page.evaluate("document.documentElement.dataset.eyes = 'on'")
    for size in ({"width": 1280, "height": 800}, {"width": 390, "height": 844}):
        page.set_viewport_size(size)
        for edge in (0, 10_000):
            page.evaluate("edge => scrollTo(0, edge)", edge)
            expect(page.get_by_text("Watching", exact=True)).to_be_in_viewport(ratio=1)
    expect(page.get_by_text("Listening", exact=True)).to_be_hidden()


def test_the_log_says_why_and_what_is_open_stays_open(studio: Page) -> None:
    page = studio
    say(page, "I feel miserable")
    entry = page.locator(".log details", has_text="because of “miserable”").first
    entry.locator("summary").focus()
    page.keyboard.press("Enter")
    expect(entry.get_by_text("“miserable” +")).to_be_visible()
    ask(page, "/stimulus", feeling="happiness", strength=0.3)
    expect(page.locator(".log li", has_text="happiness, strength 0.30")).to_be_visible()
    expect(entry.get_by_text("“miserable” +")).to_be_visible()
    # Shut at the moment at which the page writes something else.
    page.evaluate(
        """() => {
          document.querySelector(".log details[open] summary").click();
          document.body.append(document.createElement("i"));
        }"""
    )
    ask(page, "/stimulus", feeling="sadness", strength=0.3)
    expect(page.locator(".log li", has_text="sadness, strength 0.30")).to_be_visible()
    expect(entry.get_by_text("“miserable” +")).to_be_hidden()


def test_it_understands_and_answers_in_japanese(page: Page, url: str) -> None:
    open_studio(page, url + "/?lang=ja")
    line = page.get_by_label("話しかける")
    line.fill("今日はとても嬉しい")
    page.get_by_role("button", name="話す").click()
    expect(page.locator(".talk output")).to_contain_text("喜びを感じ取りました")
