"""What a participant meets: consent, one question a page, a reload, a full disk, a way out."""

import re
import sqlite3
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from starlette.testclient import TestClient
from tests.fixtures.study import TWO_FILMS, Lab, Person

from miburi.studies.study.films import FILMS
from miburi.studies.study.pages import COOKIE
from miburi.studies.study.posted import make_code
from miburi.studies.study.report import ANSWERS


def behave(question: str, film: str | None) -> dict[str, str]:
    assert film is not None
    return {"answer": film.partition("-")[0] if question == "feeling" else "shaky"}


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    return Lab(tmp_path)


def test_nobody_begins_without_consent(lab: Lab) -> None:
    browser = lab.visitor()
    assert "With your answers we keep a number" in browser.get("/").text
    refused = lab.post(browser, "", language="en")
    assert refused.status_code == 422
    assert "Please tick the box" in refused.text
    assert COOKIE not in browser.cookies
    assert lab.store.counts(4).began == 0
    back = browser.get(f"{lab.home}/page").text
    assert "With your answers we keep" in back


def test_one_question_a_page_to_the_end(lab: Lab) -> None:
    person = Person(lab, behave)
    assert person.finish() == len(lab.study.steps) == 4
    assert person.code in person.browser.get(f"{lab.home}/page").text
    answers = [(a.step, a.film, a.question, a.value) for a in lab.store.answers()]
    films = [film for _, film, question, _ in answers if question == "feeling"]
    assert sorted(films) == ["fear-0.9", "fright-0.9"]
    assert answers == [
        (0, films[0], "feeling", films[0].removesuffix("-0.9")),
        (1, films[0], "word", "shaky"),
        (2, films[1], "feeling", films[1].removesuffix("-0.9")),
        (3, films[1], "word", "shaky"),
    ]


def test_a_reload_or_a_restart_returns_to_the_same_page(lab: Lab) -> None:
    person = Person(lab, behave)
    person.answer()
    page = person.browser.get(f"{lab.home}/page").text
    assert "Question 2 of 4" in page
    (lab.folder / FILMS).rename(lab.folder / "old")
    for place in (lab, Lab(lab.folder)):
        again = place.visitor(person.code)
        assert again.get(f"{lab.home}/page").text == page
        assert again.get(lab.home).text == page  # the first address leads there, too


def test_back_and_a_second_tab_change_no_answer(lab: Lab) -> None:
    person = Person(lab, behave)
    person.answer()
    before = lab.store.answers()
    for step in ("0", "2"):
        assert lab.post(person.browser, step=step, answer="fright").status_code == 303
    assert lab.store.answers() == before

    def press(answer: str) -> int:  # a button, in many tabs at once
        return lab.post(lab.visitor(person.code), step="1", answer=answer).status_code

    with ThreadPoolExecutor(8) as pool:
        assert set(pool.map(press, ["shaky", "still"] * 4)) == {303}
    assert len(lab.store.answers()) == 2


def test_who_agrees_again_goes_on_as_the_same_participant(lab: Lab) -> None:
    person = Person(lab, behave)
    person.answer()
    again = lab.post(person.browser, "", agree="yes", language="en")  # in a second tab
    assert again.headers["location"] == f"{lab.home}/page"
    assert (person.browser.cookies[COOKIE], lab.store.counts(4).began) == (person.code, 1)


def test_a_page_of_another_participant_is_refused(lab: Lab) -> None:
    first = Person(lab, behave)
    code = first.code
    lab.post(first.browser, "/next")  # in a second tab
    lab.post(first.browser, "", agree="yes", language="en")
    for page in ("/page", "/stop", "/next"):
        refused = lab.post(first.browser, page, step="0", answer="fear", code=code)
        assert refused.headers["location"] == f"{lab.home}/page"
        assert "Question 1 of 4" in first.browser.get(f"{lab.home}/page").text
    assert lab.store.answers() == []


def test_the_information_can_be_read_again_from_every_page(lab: Lab) -> None:
    person = Person(lab, behave)
    link = f'href="{lab.home}/information"'

    def read(page: str) -> None:
        assert link in page
        told = person.browser.get(f"{lab.home}/information").text
        assert "Hello." in told
        assert "I agree to take part" not in told

    for page in ("/page", "/stop", "/withdraw"):
        read(person.browser.get(f"{lab.home}{page}").text)
    assert "Question 1 of 4" in person.browser.get(f"{lab.home}/page").text
    read(lab.post(person.browser, "/stop").text)
    lab.store.close()  # people may still have to write to whoever runs the study
    read(person.browser.get(lab.home).text)


def test_an_invalid_answer_is_asked_for_again(lab: Lab) -> None:
    browser = lab.begin()
    for data in ({}, {"answer": "joy"}, {"answer": "none"}, {"strength": "3"}):
        refused = lab.post(browser, step="0", **data)
        assert (refused.status_code, "Please choose one." in refused.text) == (422, True)
    assert lab.store.answers() == []


def test_a_word_is_kept_as_it_is_seen(lab: Lab) -> None:
    for written, kept in (
        ("  afraid ", ["afraid"]),
        ("ｓｃａｒｅｄ\x00\n", ["scared"]),
        ("<b>怖い</b>", ["<b>怖い</b>"]),
        ("x" * 80, ["x" * 80]),
        ("x" * 81, []),
        ("\u200b", []),
    ):
        person = Person(lab, behave)
        person.answer()
        done = lab.post(person.browser, step="1", answer=written)
        assert done.status_code == (303 if kept else 422)
        answers = [a.value for a in lab.store.answers() if a.question == "word"]
        assert answers == kept
        lab.store.withdraw(person.code)


def test_a_form_that_is_too_large_is_refused(lab: Lab) -> None:
    browser = lab.begin()
    assert lab.post(browser, step="0", answer="x" * 20_000).status_code == 413
    many = {f"field{k}": "1" for k in range(60)}
    assert lab.post(browser, **many).status_code == 413


def test_the_pages_of_a_japanese_participant(lab: Lab) -> None:
    browser = lab.visitor()
    page = browser.get(lab.home, headers={"accept-language": "ja-JP,en;q=0.5"}).text
    assert "二つの映像" in page
    assert 'lang="ja"' in page
    lab.post(browser, "", agree="yes", language="ja")
    page = browser.get(f"{lab.home}/page").text
    assert "どんな気持ち？" in page
    assert "恐" in page or "怖" in page  # fear, as the feelings' file names it


def test_no_address_tells_what_a_film_shows(lab: Lab) -> None:
    person = Person(lab, behave)
    answer = person.browser.get(f"{lab.home}/page")
    (address,) = re.findall(r'<video src="([^"]+)"', answer.text)
    film = person.browser.get(address)
    assert film.status_code == 200
    told = address + str(film.headers)
    assert not any(word in told for word in ("fear", "fright", "0.9"))
    half = person.browser.get(address, headers={"range": "bytes=0-3"})  # as Safari asks
    assert (half.status_code, half.text) == (206, film.text[:4])


def test_pages_run_no_script_but_the_films_and_are_kept_by_no_browser(lab: Lab) -> None:
    person = Person(lab, behave)
    for page in (lab.home, f"{lab.home}/page", f"{lab.home}/withdraw", f"{lab.home}/nowhere"):
        answer = person.browser.get(page)
        assert "default-src 'none'" in answer.headers["content-security-policy"]
        scripts = re.findall("<script[^>]*>", answer.text)
        film = f'<script src="{lab.home}/film.js" defer>'
        assert scripts == ([film] if "<video" in answer.text else [])
        assert "style=" not in answer.text
        if answer.status_code == 200:
            assert answer.headers["cache-control"] == "no-store"
    cookie = lab.post(lab.visitor(), "", agree="yes").headers["set-cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=lax" in cookie


def test_feelings_have_an_order_for_each_and_none_of_these_is_last(tmp_path: Path) -> None:
    none = 'none = { en = "none of these", ja = "どれでもない" }'
    lab = Lab(tmp_path, TWO_FILMS.replace('kind = "choice"', f'kind = "choice"\n{none}'))
    orders = set()
    for _ in range(12):
        page = lab.begin().get(f"{lab.home}/page").text
        orders.add(tuple(re.findall(r'name="answer" value="(\w+)"', page)))
    assert orders == {("fear", "fright", "none"), ("fright", "fear", "none")}


def test_the_line_around_a_field_is_seen_in_light_and_dark(lab: Lab) -> None:
    """It alone marks a field, so WCAG 2.2 (1.4.11) asks for 3:1; axe-core does not look at it."""
    style = lab.visitor().get(f"{lab.home}/style.css").text
    schemes = [dict(re.findall(r"--(\w+): (#\w{6})", root)) for root in style.split(":root")[1:]]
    assert len(schemes) == 2
    for colours in schemes:
        for beside in ("paper", "card"):
            assert contrast(colours["line"], colours[beside]) >= 3


def contrast(one: str, other: str) -> float:
    """Return the contrast of two colours, as WCAG 2.2 defines it: 1 to 21."""
    lights = []
    for colour in (one, other):
        parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
        red, green, blue = (
            p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts
        )
        lights.append(0.2126 * red + 0.7152 * green + 0.0722 * blue)
    return (max(lights) + 0.05) / (min(lights) + 0.05)


def test_only_this_computer_and_no_other_sites_page_may_ask(lab: Lab) -> None:
    away = TestClient(lab.app, base_url="http://evil.example")
    assert away.get(lab.home).status_code == 403
    foreign = lab.visitor().post(
        lab.home, data={"agree": "yes"}, headers={"origin": "http://evil.example"}
    )
    assert foreign.status_code == 403
    assert lab.store.counts(4).began == 0


@pytest.mark.parametrize("dash", ["", " ", "\N{EN DASH}", "\N{MINUS SIGN}", "ー", " - "])
def test_a_code_may_be_typed_in_many_ways(lab: Lab, dash: str) -> None:
    code = lab.begin().cookies[COOKIE]
    wide = "".join(chr(ord(letter) + 0xFEE0) for letter in code[:4])
    done = lab.post(lab.visitor(), "/withdraw", code=f"{wide}{dash}{code[5:].lower()}")
    assert "have been deleted" in done.text


def test_withdrawn_answers_are_gone_from_the_disk(lab: Lab) -> None:
    stays = Person(lab, lambda q, f: behave(q, f) | ({"answer": "kept"} if q == "word" else {}))
    goes = Person(lab, lambda q, f: behave(q, f) | ({"answer": "secret"} if q == "word" else {}))
    for person in (stays, goes):
        person.finish()
    wrong = lab.post(goes.browser, "/withdraw", code="AAAA-AAAA")
    assert wrong.status_code == 422
    assert "nothing has been deleted" in wrong.text
    assert len(lab.store.answers()) == 8
    other = sqlite3.connect(lab.folder / ANSWERS)  # of somebody who answers just now
    other.execute("SELECT COUNT(*) FROM answer").fetchall()
    done = lab.post(lab.visitor(), "/withdraw", code=f" {goes.code.lower()} ")
    assert "have been deleted" in done.text
    assert [a.value for a in lab.store.answers() if a.question == "word"] == ["kept"] * 2
    on_disk = b"".join(file.read_bytes() for file in lab.folder.glob(f"{ANSWERS}*"))
    assert b"kept" in on_disk
    assert b"secret" not in on_disk
    assert goes.code.encode() not in on_disk
    other.close()
    counts = lab.store.counts(len(lab.study.steps))
    assert (counts.began, counts.finished, counts.withdrawn) == (2, 1, 1)
    assert lab.post(goes.browser, step="0", answer="fear").headers["location"] == lab.home
    assert Person(lab, behave).browser.get(f"{lab.home}/page").status_code == 200
    assert lab.store.counts(4).began == 3  # nobody gets a number again


def test_the_next_person_at_the_same_tablet_begins_anew(lab: Lab) -> None:
    person = Person(lab, behave)
    person.answer()
    lab.post(person.browser, "/next")
    assert COOKIE not in person.browser.cookies
    assert "I agree to take part" in person.browser.get(f"{lab.home}/page").text


def test_many_at_once_keep_their_answers_apart(lab: Lab) -> None:
    def take_part(number: int) -> str:
        word = {"answer": f"word{number}"}
        person = Person(lab, lambda q, f: word if q == "word" else behave(q, f))
        person.finish()
        return person.code

    with ThreadPoolExecutor(8) as pool:
        codes = list(pool.map(take_part, range(8)))
    answers = lab.store.answers()
    assert len(set(codes)) == 8
    assert Counter(answer.participant for answer in answers) == dict.fromkeys(range(1, 9), 4)
    words = {(a.participant, a.value) for a in answers if a.question == "word"}
    assert len(words) == len({value for _, value in words}) == 8


def test_a_full_disk_loses_nothing_and_keeps_nothing_by_halves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab = Lab(tmp_path, TWO_FILMS.replace('name = "two"', 'name = "two"\ntrials = 200'))
    person = Person(lab, behave)
    connect = sqlite3.connect

    def full(*args: object, **options: object) -> sqlite3.Connection:
        database: sqlite3.Connection = connect(*args, **options)
        database.execute("PRAGMA max_page_count = 1")  # SQLite takes what there is already
        return database

    monkeypatch.setattr(sqlite3, "connect", full)
    kept = 0
    while True:
        step = str(kept)
        data = {"answer": "fear" if kept % 2 == 0 else "w" * 80}
        done = lab.post(person.browser, step=step, **data)
        if done.status_code != 303:
            break
        kept += 1
    assert kept > 5
    assert done.status_code == 503
    assert "The answers that you gave before are safe" in done.text
    assert [answer.step for answer in lab.store.answers()] == list(range(kept))
    monkeypatch.undo()
    assert f"Question {kept + 1} of 400" in person.browser.get(f"{lab.home}/page").text
    assert lab.post(person.browser, step=step, **data).status_code == 303
    assert [answer.step for answer in lab.store.answers()] == list(range(kept + 1))


def test_codes_are_easy_to_copy_and_hard_to_guess() -> None:
    codes = {make_code() for _ in range(1000)}
    assert len(codes) == 1000
    assert all(re.fullmatch(r"[2-9A-HJKMNP-Z]{4}-[2-9A-HJKMNP-Z]{4}", code) for code in codes)
