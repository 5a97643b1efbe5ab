from importlib import resources
from pathlib import Path

import pytest

from miburi.errors import DescriptionError
from miburi.feelings import FEELINGS
from miburi.feelings.catalogue import PAPER, load_catalogue

PRIDE = """
[[feeling]]
name = "pride"
words = {}
colour = { paper = "#8a5a2b", screen = "#b9783a" }
[feeling.face]
tint = "#f0c9a0"
mouth = { smile = 14 }
"""


@pytest.fixture
def text() -> str:
    return (resources.files("miburi.feelings") / "feelings.toml").read_text(encoding="utf-8")


def test_the_papers_eight_ship_in_the_papers_order() -> None:
    eight = ("happiness", "sadness", "fright", "fear", "thrill", "disgust", "anger", "surprise")
    assert eight == PAPER == FEELINGS


def test_a_ninth_feeling_is_one_more_table(tmp_path: Path, text: str) -> None:
    (tmp_path / "nine.toml").write_text(text + PRIDE)
    catalogue = load_catalogue(tmp_path / "nine.toml")
    assert catalogue.names == (*PAPER, "pride")
    assert catalogue.feeling[-1].face.mouth.smile == 14


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('name = "anger"', 'name = "Anger"', ["feeling.6.name = 'Anger'", "pattern"]),
        ('name = "anger"', 'name = "wrath"', ["anger is missing", "the eight standard ones"]),
        ('name = "anger"', 'name = "fear"', ["fear appears twice"]),
        (
            "smile = 22",
            "grin = 22",
            ["feeling.0.face.mouth.grin", "the known ones are width, down, smile"],
        ),
        ("smile = 7, ", "", ["rest.mouth.smile is missing"]),
    ],
)
def test_the_error_for_a_wrong_file_names_file_key_and_range(
    tmp_path: Path, text: str, old: str, new: str, words: list[str]
) -> None:
    assert old in text
    path = tmp_path / "mine.toml"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(DescriptionError) as refused:
        load_catalogue(path)
    for word in [str(path), *words]:
        assert word in str(refused.value)
