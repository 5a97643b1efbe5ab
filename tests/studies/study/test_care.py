"""Who answers without care is found by a rule that was there before; the rest stays private."""

import json
import sqlite3
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.fixtures.study import TWO_FILMS, Behaviour, Lab, Person

from miburi.errors import OutputError
from miburi.studies.study.pages import COOKIE
from miburi.studies.study.plan import FILE, load_study
from miburi.studies.study.report import ANSWERS, write_report
from miburi.studies.study.statistics import share_interval
from miburi.studies.study.store import StudyClosedError, open_store

CAREFUL = """
name = "careful"
languages = ["en"]
title = { en = "Four feelings" }
information = { en = "Hello." }
debriefing = { en = "It was about gestures." }
completion = "https://panel.example/done?x=1"
practice = 1

[exclude]
checks = 1
fastest = 2.0
same = 0.8
unplayed = 0.5

[[show]]
feelings = ["happiness", "sadness", "fear", "anger"]
moods = [0.9]

[[question]]
name = "age"
kind = "number"
after = "start"
low = 18
high = 110
optional = true
ask = { en = "How old are you?" }

[[question]]
name = "robots"
kind = "pick"
after = "start"
ask = { en = "Have you been with a robot?" }
answers = [{ name = "no", words = { en = "Never" } }, { name = "yes", words = { en = "Yes" } }]

[[question]]
name = "read"
kind = "check"
at = 3
right = "sadness"
ask = { en = "Please choose sadness." }

[[question]]
name = "feeling"
kind = "choice"
ask = { en = "What does it feel?" }
none = { en = "none of these" }

[[question]]
name = "strength"
kind = "rating"
only_if = "feeling"
ask = { en = "How strong is it?" }
items = [{ name = "strength", low = { en = "weak" }, high = { en = "strong" } }]
"""


def participant(feeling: str = "", check: str = "sadness", plays: str = "1") -> Behaviour:
    """Return the answers of somebody who always chooses one feeling, or else the film's."""

    def behave(question: str, film: str | None) -> dict[str, str]:
        given = {"age": "71", "robots": "no", "read": check}.get(question)
        given = given or feeling or (film or "").partition("-")[0]
        return {"answer": given, "strength": "4", "plays": plays}

    return behave


def report(lab: Lab) -> dict:
    page = write_report(lab.study, lab.folder, lab.folder / "report")
    return json.loads((page.parent / "findings.json").read_text(encoding="utf-8"))


def test_careless_participants_are_left_out_and_named(tmp_path: Path) -> None:
    now = 0.0

    def tell() -> float:
        nonlocal now
        now += seconds
        return now

    seconds = 3.0  # between two looks at the clock
    lab = Lab(tmp_path, CAREFUL, clock=tell)
    hasty = participant()
    careless = [participant(plays="0"), participant("fear"), participant(check="fear"), hasty]
    for behaviour in [participant(), *careless]:
        seconds = 0.1 if behaviour is hasty else 3.0
        Person(lab, behaviour).finish()
    found = report(lab)
    assert {one["participant"]: one["reasons"] for one in found["left_out"]} == {
        2: ["0 of 4 films started"],
        3: ["fear in 4 of 4 films"],
        4: ["1 checks wrong"],
        5: ["a median of 0.1 s for a page"],
    }
    # Practice and those who are left out count in no figure.
    assert found["choices"][0]["right"]["of"] == 4
    assert found["ratings"][0]["all"]["answers"] == 4
    assert found["people"] == [
        {"question": "robots", "counts": {"no": 1, "yes": 0}, "quartiles": None, "silent": 0},
        {"question": "age", "counts": {}, "quartiles": [71, 71, 71], "silent": 0},
    ]
    page = (tmp_path / "report" / "index.html").read_text(encoding="utf-8")
    assert "participant 3 (fear in 4 of 4 films)" in page
    assert set(found["made_with"]["films"]) == {film.name for film in lab.study.films}


def test_a_report_says_how_many_films_nobody_started(tmp_path: Path) -> None:
    lab = Lab(tmp_path, CAREFUL.replace("fastest = 2.0\n", ""))
    never = participant(plays="0")
    Person(lab, never).finish()  # is left out
    Person(
        lab, lambda asked, film: (never if film == "fear-0.9" else participant())(asked, film)
    ).finish()
    found = report(lab)
    assert [one["participant"] for one in found["left_out"]] == [1]
    assert found["unplayed"] == 1
    page = (tmp_path / "report" / "index.html").read_text(encoding="utf-8")
    assert "answered about 1 films that they had not started" in page


def test_none_of_these_is_no_carelessness_and_has_no_strength(tmp_path: Path) -> None:
    lab = Lab(tmp_path, CAREFUL.replace("fastest = 2.0\n", ""))
    chosen = iter(["fear"] * 3 + ["none"] * 2)  # the first for practice
    asked: list[str] = []

    def behave(question: str, film: str | None) -> dict[str, str]:
        asked.append(question)
        return dict(participant(next(chosen) if question == "feeling" else "")(question, film))

    Person(lab, behave).finish()
    found = report(lab)
    assert asked.count("strength") == 3
    assert (found["left_out"], found["counts"]["finished"]) == ([], 1)
    assert found["ratings"][0]["all"]["answers"] == 2


def test_what_need_not_be_said_may_be_left_out(tmp_path: Path) -> None:
    lab = Lab(tmp_path, CAREFUL)
    browser = lab.begin()
    for wrong in ("17", "111", "x", "1e2", "-20"):
        assert "whole number from 18 to 110" in lab.post(browser, step="0", answer=wrong).text
    assert lab.post(browser, step="0", answer="").status_code == 303
    assert "Have you been with a robot?" in browser.get(f"{lab.home}/page").text
    assert "Please choose one" in lab.post(browser, step="1", answer="").text  # not optional


def test_practice_is_called_so_and_the_last_page_leads_on(tmp_path: Path) -> None:
    lab = Lab(tmp_path, CAREFUL)
    person = Person(lab, participant())
    pages = []
    for _ in range(6):
        pages.append(person.browser.get(f"{lab.home}/page").text)
        person.answer()
    assert ["for practice" in page for page in pages] == [False, False, True, True, False, False]
    person.finish()
    page = person.browser.get(f"{lab.home}/page").text
    assert "It was about gestures." in page
    assert 'href="https://panel.example/done?x=1"' in page
    assert "It was about gestures." in lab.post(person.browser, "/withdraw", code=person.code).text


def test_who_stops_early_reads_what_it_was_about_and_answers_no_more(tmp_path: Path) -> None:
    lab = Lab(tmp_path, CAREFUL)
    assert lab.visitor().get(f"{lab.home}/stop", follow_redirects=False).status_code == 303
    person = Person(lab, participant())
    person.answer()
    before = person.browser.get(f"{lab.home}/page").text
    assert f'href="{lab.home}/stop"' in before
    assert "It was about gestures." not in person.browser.get(f"{lab.home}/stop").text
    assert person.browser.get(f"{lab.home}/page").text == before
    left = lab.post(person.browser, "/stop").text
    assert "It was about gestures." in left
    assert person.code in left
    assert "panel.example" not in left  # the panel would take it for the end
    # Whoever knows what it is about answers no more, and the next one at a tablet begins anew.
    kept = lab.store.answers()
    lab.post(person.browser, step="1", answer="no", code=person.code)  # in a second tab
    lab.post(person.browser, "", agree="yes", language="en")
    for page in ("", "/page", "/stop"):
        assert person.browser.get(f"{lab.home}{page}").text == left
    assert (lab.store.answers(), lab.store.counts(len(lab.study.steps)).began) == (kept, 1)
    assert f'value="{person.code}"' in person.browser.get(f"{lab.home}/withdraw").text
    lab.post(person.browser, "/next")
    assert "I agree to take part" in person.browser.get(f"{lab.home}/page").text


def test_who_has_stopped_and_withdraws_is_forgotten(tmp_path: Path) -> None:
    lab = Lab(tmp_path, CAREFUL)
    person = Person(lab, participant())
    lab.post(person.browser, "/stop")
    assert "have been deleted" in lab.post(person.browser, "/withdraw", code=person.code).text
    assert "miburi_study" not in person.browser.cookies


@pytest.mark.parametrize("times", [True, False])
def test_times_are_kept_only_if_the_study_says_so(tmp_path: Path, times: bool) -> None:
    lab = Lab(tmp_path, TWO_FILMS if times else f"times = false\n{TWO_FILMS}")
    page = lab.visitor().get(lab.home, headers={"accept-language": "en"}).text
    assert ("how many seconds" in page) == times
    for plays in ("3", "", "-1", "1000", "x", "٣"):  # all but the first make no sense
        Person(lab, participant("fear", plays=plays)).answer()
    kept = [pace.plays for pace in lab.store.paces().values()]
    assert kept == ([3, *[None] * 5] if times else [])


def test_words_may_be_mended_but_not_what_is_asked(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    lab.begin()
    file = tmp_path / FILE
    file.write_text(TWO_FILMS.replace("Hello.", "Hello!").replace("In a word?", "One word?"))
    store = open_store(tmp_path / ANSWERS, load_study(tmp_path))
    assert store.wordings() == []  # nobody has read them
    store.enter("AAAA-AAAA", "en")
    assert store.wordings() == [2]
    write_report(load_study(tmp_path), tmp_path, tmp_path / "report")
    page = (tmp_path / "report" / "index.html").read_text(encoding="utf-8")
    assert "From participant 2 on, some of the study's words were others" in page
    file.write_text(TWO_FILMS.replace('["fear", "fright"]', '["fear", "anger"]'))
    with pytest.raises(
        OutputError, match="The wording of a study that people have begun may change"
    ):
        open_store(tmp_path / ANSWERS, load_study(tmp_path))


def test_a_plan_may_change_as_long_as_nobody_has_begun(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    lab.store.withdraw(lab.begin().cookies[COOKIE])
    changed = TWO_FILMS.replace('["fear", "fright"]', '["fear", "anger"]')
    (tmp_path / FILE).write_text(changed, encoding="utf-8")
    open_store(tmp_path / ANSWERS, load_study(tmp_path)).enter("AAAA-AAAA", "en")
    # A server that still runs with the plan before would mix the answers.
    with pytest.raises(OutputError, match="belongs to another study file"):
        lab.store.enter("BBBB-BBBB", "en")


def test_answers_that_may_not_be_written_are_refused_but_can_be_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    lab = Lab(tmp_path)
    person = Person(lab, participant("fear"))
    person.answer()
    connect = sqlite3.connect

    def read_only(file: object, **options: Any) -> sqlite3.Connection:
        address = file if options.get("uri") else f"{Path(str(file)).as_uri()}?mode=ro"
        database: sqlite3.Connection = connect(address, **options | {"uri": True})
        return database

    monkeypatch.setattr(sqlite3, "connect", read_only)
    assert lab.post(person.browser, step="1", answer="fear").status_code == 503
    assert "the file or its folder may not be written" in caplog.text
    with pytest.raises(OutputError, match="the file or its folder may not be written"):
        open_store(tmp_path / ANSWERS, lab.study)
    assert report(lab)["choices"][0]["right"]["of"] == 1


def test_the_next_person_gets_the_place_of_somebody_who_has_gone(tmp_path: Path) -> None:
    now = [0.0]
    lab = Lab(tmp_path, clock=lambda: now[0])
    people = [Person(lab, participant("fear")) for _ in range(3)]
    lab.store.withdraw(people[0].code)
    people[1].finish()
    people[2].answer()
    assert lab.store.enter("AAAA-AAAA", "en").place == 1
    now[0] += 3 * 3600  # the third is gone, and has not finished
    lab.begin()
    known = [lab.store.find(one.code) for one in people[1:]]
    assert [one.place for one in known if one] == [2, 3]
    assert lab.store.enter("BBBB-BBBB", "en").place == 4


def test_a_closed_study_has_no_code_left_on_the_disk(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    person = Person(lab, participant("fear"))
    person.answer()
    assert lab.store.close() == 1
    assert lab.store.find(person.code) is None
    assert not lab.store.withdraw(person.code)
    assert [answer.value for answer in lab.store.answers()] == ["fear"]
    assert all(person.code.encode() not in file.read_bytes() for file in tmp_path.glob("answers*"))


def test_a_study_that_is_closed_while_it_runs_admits_and_keeps_nothing(tmp_path: Path) -> None:
    lab = Lab(tmp_path, CAREFUL)
    person, newcomer = Person(lab, participant()), lab.visitor()
    person.answer()
    kept = lab.store.answers()
    lab.store.close()  # in another terminal
    for told in (
        lab.post(person.browser, step="1", answer="no"),
        lab.post(person.browser, "/stop"),
        lab.post(newcomer, "/withdraw", code=person.code),
        lab.post(newcomer, "", agree="yes"),
        newcomer.get(lab.home),
    ):
        assert (told.status_code, "This study has ended" in told.text) == (410, True)
        assert "It was about gestures." in told.text
    with pytest.raises(StudyClosedError):  # it is closed while somebody begins
        lab.store.enter("AAAA-AAAA", "en")
    assert (lab.store.answers(), lab.store.counts(13).began) == (kept, 1)


def test_the_end_of_a_study_is_told_in_the_visitors_language(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    lab.store.close()
    told = lab.visitor().get(lab.home, headers={"accept-language": "ja"}).text
    assert "この調査は終了しました" in told


def test_intervals_hold_what_they_promise_when_people_differ() -> None:
    """Twenty people, 24 films each: the true share is inside 93 to 97 of 100 intervals."""
    rng = np.random.default_rng(1)
    skills = 1 / (1 + np.exp(-rng.normal(0.3, 0.9, 200_000)))
    truth, inside = float(skills.mean()), 0
    for people in skills[:10_000].reshape(500, 20):
        hits = (rng.random((20, 24)) < people[:, None]).tolist()
        low, high = share_interval(hits) or (0, 1)
        inside += low <= truth <= high
    assert 0.93 <= inside / 500 <= 0.97
