"""Twenty simulated participants of known behaviour: the report finds what was put in."""

import csv
import json
import sqlite3
from pathlib import Path

import pyarrow.parquet
import pytest
from tests.fixtures.study import TWO_FILMS, Lab, Person

from miburi.errors import InputError
from miburi.studies.study.order import film_order
from miburi.studies.study.plan import load_study
from miburi.studies.study.report import ANSWERS, write_report

STUDY = """
name = "four"
seed = 3
languages = ["en"]
title = { en = "Four feelings" }
information = { en = "Hello." }

[[show]]
feelings = ["happiness", "fear", "fright", "anger"]
moods = [0.3, 0.6, 0.9]

[[question]]
name = "feeling"
kind = "choice"
ask = { en = "What does it feel?" }
none = { en = "none of these" }

[[question]]
name = "strength"
kind = "rating"
ask = { en = "How strong is it?" }
items = [{ name = "strength", low = { en = "weak" }, high = { en = "strong" } }]

[[question]]
name = "service"
kind = "rating"
after = "all"
points = 5
ask = { en = "How was it?" }
items = [
  { name = "q1", low = { en = "bad" }, high = { en = "good" } },
  { name = "q2", low = { en = "bad" }, high = { en = "good" } },
  { name = "q3", low = { en = "good" }, high = { en = "bad" }, reversed = true },
]
"""
#: Statology's restaurant guests: the package pingouin prints an alpha of 0.7734375 for them.
GUESTS = [
    (1, 1, 1), (2, 1, 1), (2, 1, 2), (3, 2, 1), (2, 3, 2),
    (2, 3, 3), (3, 2, 3), (3, 3, 3), (2, 3, 2), (3, 3, 3),
]  # fmt: skip


def given(number: int, question: str, film: str | None) -> dict[str, str]:
    """Take fear for fright, and the rest for what it is; to 1, 3, … small anger looks strong."""
    if film is None:
        q1, q2, q3 = GUESTS[number % 10]
        return {"q1": f"{q1}", "q2": f"{q2}", "q3": f"{6 - q3}"}
    feeling, _, mood = film.partition("-")
    if question == "feeling":
        return {"": "fright" if feeling == "fear" else feeling}
    strength = round(float(mood) / 0.3) * 2
    return {"strength": f"{8 - strength if feeling == 'anger' and number % 2 else strength}"}


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Lab:
    """Twenty people answer all questions."""
    lab, rows = Lab(tmp_path_factory.mktemp("study"), STUDY), []
    for number in range(20):
        place = lab.store.enter(f"{number}", "en").place
        order = film_order(12, 12, place, lab.study.seed)
        for index, step in enumerate(lab.study.steps):
            film = None if step.trial is None else lab.study.films[order[step.trial]].name
            question = step.question.name
            values = given(number, question, film).items()
            rows += [(number + 1, index, film, question, *pair) for pair in values]
    with sqlite3.connect(lab.folder / ANSWERS) as database:  # at once: each page is synced
        database.executemany("INSERT INTO answer VALUES (?, ?, ?, ?, ?, ?)", rows)
    database.close()
    return lab


@pytest.fixture(scope="module")
def out(lab: Lab, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("report")
    assert write_report(lab.study, lab.folder, folder) == folder / "index.html"
    return folder


@pytest.fixture(scope="module")
def found(out: Path) -> dict:
    return json.loads((out / "findings.json").read_text(encoding="utf-8"))


def test_the_confusion_is_the_one_that_was_put_in(found: dict) -> None:
    assert found["counts"] == {"began": 20, "finished": 20, "withdrawn": 0}
    (choice,) = found["choices"]
    assert choice["labels"] == ["happiness", "fright", "fear", "anger", "none"]
    assert choice["confusion"] == [
        [60, 0, 0, 0, 0],
        [0, 60, 0, 0, 0],
        [0, 60, 0, 0, 0],
        [0, 0, 0, 60, 0],
        [0, 0, 0, 0, 0],
    ]
    assert (choice["right"]["hits"], choice["right"]["of"]) == (180, 240)
    # Wilson (1927) by hand: (0.75 + a) / (1 + 2a) -+ t sqrt(0.1875 / 240 + a / 480) / (1 + 2a),
    # where t = 2.0930 of 19 degrees of freedom and a = t² / 480 = 0.009126.
    assert choice["right"]["low"] == pytest.approx(0.6874, abs=1e-4)
    assert choice["right"]["high"] == pytest.approx(0.8037, abs=1e-4)
    # Of each person's answers, 1/4 are happiness, 1/2 fright and 1/4 anger. Nobody chose "none".
    assert choice["right"]["chance"] == pytest.approx((1 / 4 + 1 / 2 + 0 + 1 / 4) / 4)
    assert choice["right"]["p"] == pytest.approx(1 / 5000)
    assert choice["by_feeling"]["anger"]["p"] == pytest.approx(4 / 5000)  # of four rows
    fear = choice["by_feeling"]["fear"]
    assert (fear["hits"], fear["chance"], fear["p"]) == (0, 0, 1)
    # Wagner (1993): 60² / (60 · 120) of fright, since fear was taken for it, too.
    assert choice["unbiased"] == {"happiness": 1, "fright": 0.5, "fear": 0, "anger": 1}
    hits = {mood: share["hits"] for mood, share in choice["by_mood"].items()}
    assert hits == {"0.3": 60, "0.6": 60, "0.9": 60}
    assert choice["kappa"] == pytest.approx((0.75 - 0.25) / (1 - 0.25))
    assert choice["fleiss"] == pytest.approx(1)  # all saw the same in each film


def test_the_order_of_intensities_and_alpha_with_a_reversed_item(found: dict) -> None:
    strength, service = found["ratings"]
    assert (strength["order"]["right"], strength["order"]["pairs"]) == (240 - 30, 240)
    anger = strength["by_feeling"]["anger"]
    assert (anger["right"], anger["pairs"]) == (30, 60)
    # Ten people with 0 and ten with 1: 0.5 -+ t sqrt(0.25 / 19).
    assert anger["low"] == pytest.approx(0.5 - 2.0930 * 0.25**0.5 / 19**0.5, abs=1e-4)
    fear = [strength["means"]["fear"][mood] for mood in ("0.3", "0.6", "0.9")]
    assert [(one["mean"], one["sd"], one["low"], one["high"]) for one in fear] == [
        (2, 0, 2, 2), (4, 0, 4, 4), (6, 0, 6, 6),
    ]  # fmt: skip
    assert strength["alpha"] is None  # one item
    assert service["alpha"] == pytest.approx(0.7734375)
    assert service["items"]["q3"]["mean"] == pytest.approx(sum(row[2] for row in GUESTS) / 10)
    assert (service["turned"], service["means"]) == (["q3"], {})


def test_csv_and_parquet_hold_every_answer_and_no_code(out: Path) -> None:
    with (out / "answers.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    table = pyarrow.parquet.read_table(out / "answers.parquet").to_pylist()
    assert len(rows) == len(table) == 20 * (12 * 2 + 3)
    assert [row["value"] for row in rows] == [row["value"] for row in table]
    fear = [row for row in table if row["film"] == "fear-0.6" and row["question"] == "feeling"]
    assert {(row["feeling"], row["mood"], row["face"], row["value"]) for row in fear} == {
        ("fear", 0.6, False, "fright")
    }
    assert set(rows[0]) == {
        "participant", "language", "step", "film", "feeling", "mood", "face", "whole",
        "broken", "others", "question", "item", "value", "practice", "seconds", "plays", "left_out",
    }  # fmt: skip


def test_the_same_answers_give_the_same_report(lab: Lab, out: Path, tmp_path: Path) -> None:
    write_report(lab.study, lab.folder, tmp_path)
    for name in ("index.html", "findings.json", "answers.csv", "feeling.png", "strength.png"):
        assert (tmp_path / name).read_bytes() == (out / name).read_bytes(), name
    page = (out / "index.html").read_text(encoding="utf-8")
    for words in (
        "20 people began, 20 finished, 0 withdrew",
        "180 of 240, 75 % (69 to 80 %); guessing gives 25.0 % (p &lt; 0.001)",
        "&lt; 0.001",
        "shown turned, 6 \N{MINUS SIGN} value",
        "κ of the choice against the intended feeling is 0.67",
        "88 % (81 to 94 %) are rated in the order",
        "α of its 3 items is 0.77",
        'src="feeling.png"',
        'src="strength.png"',
    ):
        assert words in page


def test_a_report_in_the_middle_counts_what_is_there(tmp_path: Path) -> None:
    lab = Lab(tmp_path, TWO_FILMS)
    words = iter(["=2+2", "Shaky", "shaky"])
    people = [
        Person(lab, lambda q, _: {"answer": "fear" if q == "feeling" else next(words)})
        for _ in range(2)
    ]
    for one in (*people, *people, people[0], people[0]):
        one.answer()
    write_report(lab.study, tmp_path, tmp_path / "report")
    found = json.loads((tmp_path / "report" / "findings.json").read_text(encoding="utf-8"))
    assert found["counts"] == {"began": 2, "finished": 1, "withdrawn": 0}
    assert found["choices"][0]["right"]["of"] == 3
    assert found["choices"][0]["fleiss"] is None
    written = [pair for words in found["words"][0]["words"].values() for pair in words]
    assert sorted(count for word, count in written if word == "shaky") in ([1, 1], [2])
    # A spreadsheet must not take somebody's word for a formula.
    assert "'=2+2" in (tmp_path / "report" / "answers.csv").read_text(encoding="utf-8")


def test_a_study_without_answers_has_a_report_of_nothing(tmp_path: Path) -> None:
    Lab(tmp_path, STUDY)
    write_report(load_study(tmp_path), tmp_path, tmp_path / "report")
    assert "0 people began" in (tmp_path / "report" / "index.html").read_text(encoding="utf-8")
    (tmp_path / ANSWERS).unlink()
    with pytest.raises(InputError, match=f"no {ANSWERS}"):
        write_report(load_study(tmp_path), tmp_path, tmp_path / "report")
