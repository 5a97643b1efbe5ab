"""What somebody tells of their life in passing is kept; what is said for the moment is not."""

from pathlib import Path

import pytest

from miburi.talk.asking import tells_a_fact
from miburi.talk.remembering import facts_in
from miburi.talk.script import script

LINES = Path(__file__).parents[2] / "bench" / "fact-lines"


@pytest.mark.parametrize(("language", "kept", "wrong"), [("en", 0.8, 0.08), ("ja", 0.6, 0.05)])
def test_facts_told_in_passing_are_kept(language: str, kept: float, wrong: float) -> None:
    """Of a stranger's lines 41 and 23 of a hundred were kept, when patterns alone decided."""
    file = LINES / f"{language}.tsv"
    rows = [line.split("\t") for line in file.read_text(encoding="utf-8").splitlines()]
    told = [bool(facts_in(said, script(language))) for said, fact, _ in rows if fact]
    other = [bool(facts_in(said, script(language))) for said, fact, _ in rows if not fact]
    assert sum(told) >= kept * len(told)
    assert sum(other) <= wrong * len(other)


def test_a_question_is_no_fact() -> None:
    assert facts_in("My wife is a nurse at the county hospital, isn't she?", script("en")) == []


def test_a_fact_over_two_sentences_is_kept_whole() -> None:
    said = "Two cats, one goldfish. No husband."
    assert facts_in(said, script("en")) == [said]


def test_without_a_model_patterns_alone_decide() -> None:
    assert not tells_a_fact("Ma fille est infirmière à Lyon.", "fr")
    assert facts_in("Ma fille habite à Lyon.", script("fr")) != []
