"""The page of people: a person allows, corrects and deletes what the partner knows of them."""

import pytest
from playwright.sync_api import Page, expect
from tests.fixtures.browser import ask, look_over, needs_browser

from miburi.studio.words import words

pytestmark = needs_browser


JAPANESE = pytest.param(
    "ja", marks=pytest.mark.proof("test_it_understands_and_answers_in_japanese")
)


@pytest.mark.parametrize("language", ["en", JAPANESE])
def test_what_it_knows_is_seen_corrected_and_deleted(page: Page, url: str, language: str) -> None:
    say = words(language)["people"]
    page.goto(url + "/people")
    for text in ("My name is Anna.", "My daughter comes on Sunday.", "I was born in Leeds."):
        ask(page, "/say", text=text)
    page.context.add_cookies([{"name": "miburi_language", "value": language, "url": url}])
    page.reload()
    page.once("dialog", lambda dialog: dialog.accept())
    expect(page.get_by_role("heading", name="Anna")).to_be_visible()
    page.get_by_role("button", name=say["allow"]).click()
    expect(page.get_by_role("button", name=say["forbid"])).to_be_visible()
    assert look_over(page, "people") == []
    page.get_by_role("button", name=say["correct"]).first.click()
    line = page.get_by_role("textbox", name=say["correct"])
    line.fill("My daughter comes on Monday.")
    line.press("Enter")
    expect(page.get_by_text("My daughter comes on Monday.")).to_be_visible()
    page.get_by_role("button", name=say["delete"], exact=True).last.click()
    expect(page.get_by_text("I was born in Leeds.")).to_have_count(0)
    page.get_by_role("checkbox").check()
    page.get_by_label(say["most"]).fill("3")
    page.locator("#manners").get_by_role("button").click()
    expect(page.get_by_role("status")).to_have_text(say["done"])
    page.reload()
    expect(page.get_by_label(say["most"])).to_have_value("3")
    page.get_by_role("checkbox").uncheck()
    page.locator("#manners").get_by_role("button").click()
    expect(page.get_by_role("status")).to_have_text(say["done"])
    page.get_by_role("button", name=say["forbid"]).click()
    expect(page.get_by_text(say["nobody"])).to_be_visible()
