"""A line typed to the partner, and what it says that it understood."""

import re
from urllib.parse import urljoin

from playwright.sync_api import Page, expect
from tests.fixtures.browser import ask, needs_browser, posts, until

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


def test_it_says_what_it_heard_and_why_and_what_it_feels_and_so_does_the_log(
    studio: Page,
) -> None:
    page = studio
    page.set_viewport_size({"width": 1000, "height": 720})
    _understands(page)
    entry = page.locator(".log details", has_text="because of “sad”").first
    entry.locator("summary").focus()
    page.keyboard.press("Enter")
    expect(entry.get_by_text("“sad” +")).to_be_visible()
    ask(page, "/stimulus", feeling="happiness", strength=0.3)
    expect(page.locator(".log li", has_text="happiness, strength 0.30")).to_be_visible()
    expect(entry.get_by_text("“sad” +")).to_be_visible()  # what is open stays open
    # Shut at the moment at which the page writes something else.
    page.evaluate(
        """() => {
          document.querySelector(".log details[open] summary").click();
          document.body.append(document.createElement("i"));
        }"""
    )
    ask(page, "/stimulus", feeling="sadness", strength=0.3)
    expect(page.locator(".log li", has_text="sadness, strength 0.30")).to_be_visible()
    expect(entry.get_by_text("“sad” +")).to_be_hidden()


def test_the_face_says_so_too_and_has_one_panel_open_at_a_time(face: Page) -> None:
    face.set_viewport_size({"width": 390, "height": 720})
    face.get_by_text("Say something", exact=True).click()
    _understands(face)
    face.get_by_text("Voice and senses").click()
    expect(face.get_by_role("switch").first).to_be_visible()
    expect(face.get_by_label("Say something to it")).to_be_hidden()


def test_the_open_panel_shows_an_answer_and_no_caption_repeats_it(face: Page) -> None:
    face.evaluate(
        """() => { const place = document.querySelector("#spoken"); window.captions = [];
        new MutationObserver(() => captions.push(place.textContent))
          .observe(place, { childList: true }); }"""
    )
    face.get_by_text("Say something", exact=True).click()
    say(face, "The table has four legs")
    frames = int(face.evaluate("document.body.dataset.frames"))
    face.wait_for_function(f"document.body.dataset.frames > {frames + 60}")
    ask(face, "/speak", text="Somebody is at the door.")
    expect(face.locator("#spoken")).to_have_text("Somebody is at the door.")
    assert set(face.evaluate("captions")) <= {"", "Somebody is at the door."}


def _understands(page: Page) -> None:
    """Say three things; check what is answered."""
    heard = say(page, "I am so sad today")
    expect(page.locator(".talk output")).to_be_in_viewport(ratio=1)
    assert heard.startswith("“")  # the answer comes first
    assert "\nI heard sadness in “sad”" in heard
    assert "% sure" in heard
    assert "Now I feel sadness" in heard
    until(page, lambda now: now["emotion"][1] > 0.1)
    page.get_by_text("What pointed to this feeling, and how strongly").first.click()
    assert re.search(r"“sad” \+\d+\.\d", page.locator(".talk details").inner_text())
    assert say(page, "The table has four legs").endswith("”\nNo feeling heard.")
    assert say(page, "How are you?").endswith("”\nYou asked how I feel.")


def test_it_understands_and_answers_in_japanese(page: Page, url: str) -> None:
    page.goto(url + "/face?lang=ja")
    page.locator("#talk summary").first.click()
    line = page.get_by_label("話しかける")
    line.fill("今日はとても嬉しい")
    page.get_by_role("button", name="話す").click()
    expect(page.locator(".talk output")).to_contain_text("喜びを感じ取りました")
