"""The study that ships works as it is; a wrong file is refused in words."""

from pathlib import Path

import pytest
from tests.fixtures.study import TWO_FILMS

from miburi.errors import DescriptionError
from miburi.studies.study.plan import FILE, TEMPLATE, load_study


def refuse(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / FILE).write_text(text, encoding="utf-8")
    with pytest.raises(DescriptionError, match=words):
        load_study(tmp_path)


def test_the_study_that_ships_asks_about_eight_feelings_at_three_moods(tmp_path: Path) -> None:
    (tmp_path / FILE).write_text(TEMPLATE.read_text(encoding="utf-8"), encoding="utf-8")
    study = load_study(tmp_path)
    assert len(study.films) == 24
    assert len(study.steps) == 2 + (1 + 24) * 3 + 2 + 1
    assert len(study.unfilled) == 2 * 13  # in both languages
    [feeling] = [question for question in study.question if question.name == "feeling"]
    assert len(study.options(feeling)) == 9


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('["fear", "fright"]', '["fear", "joy"]', "joy"),
        ('["fear", "fright"]', '["fear", "fear"]', "fear-0.9 appears twice among the films"),
        ("moods = [0.9]", "moods = [1.1]", "moods"),
        ("moods = [0.9]", 'moods = [0.9]\nfile = "a.mp4"', "a film of your own shows one feeling"),
        ("moods = [0.9]", 'moods = [0.9]\nfile = "../a.mp4"', "file"),
        ("moods = [0.9]", "moods = [0.9]\nlive = true\nfaces = [true]", "the phone shows the face"),
        ('kind = "word"', 'kind = "rating"', "a rating needs at least one item"),
        ('kind = "word"', 'kind = "word"\noptions = ["fear"]', "only a choice has"),
        ('kind = "choice"', 'kind = "choice"\nafter = "all"', "belongs to a film"),
        (', ja = "一言で？"', "", "'In a word.' is missing in ja"),
        ('name = "word"', 'name = "feeling"', "feeling appears twice among the questions"),
        ('name = "two"', 'name = "two"\ntrails = 3', "the known ones are .*trials"),
        ('kind = "word"', 'kind = "pick"', "a pick needs at least two answers"),
        ('kind = "word"', 'kind = "word"\nright = "fear"', "needs both 'right' and 'at'"),
        ('kind = "word"', 'kind = "check"\nright = "joy"\nat = 1', "joy"),
        ('kind = "word"', 'kind = "check"\nright = "anger"\nat = 1', "not one of its options"),
        ('kind = "word"', 'kind = "check"\nright = "fear"\nat = 3', "sees 2 films"),
        (
            'name = "word"\nkind = "word"',
            'name = "feeling"\nkind = "check"\nright = "anger"\nat = 3',
            "twice among the questions; .*not one of its options; .*sees 2 films",
        ),
        (
            'kind = "word"\nask = { en = "In a word?"',
            'kind = "check"\nright = "fear"\nat = 1\nask = { en = "Please choose “surprise”."',
            r"'right' is 'fear', but its text \(en\) names surprise",
        ),
        ('kind = "word"', 'kind = "word"\nonly_if = "word"', r"one of \["),
        (
            'name = "word"\nkind = "word"',
            'name = "between"\nkind = "word"\nask = { en = "?", ja = "?" }\n[[question]]\n'
            'name = "word"\nkind = "word"\nonly_if = "feeling"',
            "word has only_if, so it must come right after feeling",
        ),
        ('kind = "word"', 'kind = "number"\nlow = 9\nhigh = 9', "low must be less than high"),
        ('kind = "choice"', 'kind = "choice"\noptional = true', "may be optional"),
    ],
)
def test_a_wrong_study_is_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in TWO_FILMS
    refuse(tmp_path, TWO_FILMS.replace(old, new), words)
