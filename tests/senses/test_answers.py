"""Small answers: for every feeling, in every language, never the same twice running."""

import itertools

import pytest
from pydantic import ValidationError

from miburi.feelings import FEELINGS, Expression
from miburi.senses import Impression
from miburi.senses.answers import Answerer, Answers, shipped_answers
from miburi.senses.language import Language, language_of

LANGUAGES = ("en", "ja")
CASES = [
    (Impression(heard, 0.9, "speech"), None if own is None else Expression(own, 0.5))
    for heard, own in itertools.product((None, *FEELINGS), (None, *FEELINGS))
]


@pytest.mark.parametrize("language", LANGUAGES)
def test_it_never_says_the_same_twice_running(language: str) -> None:
    answerer, answers = Answerer(), shipped_answers(language)
    for heard, own in CASES:
        said = [answerer.answer(heard, own, answers) for _ in range(20)]
        assert all(one != next_one for one, next_one in itertools.pairwise(said))
        assert {language_of(text) for text in said} == {language}


@pytest.mark.parametrize("language", LANGUAGES)
def test_asked_what_it_feels_it_says_so(language: Language) -> None:
    answerer, answers = Answerer(), shipped_answers(language)
    asked = Impression(None, 0.0, "speech", topic="asked")
    felt = {
        own: {answerer.answer(asked, own and Expression(own, 0.9), answers) for _ in range(40)}
        for own in (None, *FEELINGS)
    }
    for one, other in itertools.combinations(felt.values(), 2):
        assert one.isdisjoint(other), "each feeling has words of its own"


@pytest.mark.parametrize("language", LANGUAGES)
def test_the_same_seed_gives_the_same_talk_and_another_seed_another(language: str) -> None:
    def talk(seed: int) -> list[str]:
        answerer, answers = Answerer(seed), shipped_answers(language)
        return [answerer.answer(heard, own, answers) for heard, own in CASES]

    assert talk(1) == talk(1)
    assert talk(1) != talk(2)


@pytest.mark.parametrize("language", LANGUAGES)
def test_what_is_heard_and_what_is_felt_both_matter(language: str) -> None:
    answers = shipped_answers(language)
    assert set(answers.lines("sadness", "sadness")).isdisjoint(
        answers.lines("sadness", "happiness")
    )
    assert set(answers.lines("sadness", None)).isdisjoint(answers.lines("anger", None))
    for feeling in FEELINGS:
        assert feeling in answers.root, "each of the paper's feelings has a table of its own"
        assert feeling in answers.root["none"]


def test_a_feeling_without_a_table_is_answered_all_the_same() -> None:
    answers = shipped_answers("en")
    assert answers.lines("pride", "pride") == answers.root["any"]["any"]
    assert answers.lines(None, "pride") == answers.root["none"]["any"]


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"any": {"any": ["a", "b"]}}, "none, asked is missing"),
        ({"any": {"any": ["a", "b"]}, "none": {"fear": ["a", "b"]}}, "none.any is missing"),
        ({"any": {"any": ["a"]}, "none": {"any": ["a", "b"]}}, "at least 2"),
        ({name: {"any": ["a", "a"]} for name in ("any", "none", "asked")}, "twice"),
        ({"boredom": {"any": ["a", "b"]}}, "boredom"),
    ],
)
def test_a_wrong_table_is_refused_in_words(table: object, words: str) -> None:
    with pytest.raises(ValidationError, match=words):
        Answers.model_validate(table)
