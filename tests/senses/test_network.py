"""The network of words gives likelihoods for any text, and agrees with itself and the others."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miburi.languages import plain
from miburi.senses.kinds import KINDS
from miburi.senses.network import agreed, load_network, steps_of
from miburi.talk.asking import asked_for

NETWORK = {language: load_network("distress", language) for language in ("en", "ja")}


@settings(max_examples=40)
@given(st.sampled_from(["en", "ja"]), st.text(max_size=80))
def test_any_text_gets_likelihoods(language: str, text: str) -> None:
    network = NETWORK[language]
    assert network is not None
    likely = network(plain(text, language))
    assert likely.shape == (len(KINDS) + 1,)
    assert likely.sum() == pytest.approx(1)
    assert (likely >= 0).all()


def test_the_places_of_a_sentence() -> None:
    assert [len(step) for step in steps_of("two words", "en")] == [1, 1]
    assert [len(step) for step in steps_of("三文字", "ja")] == [2, 2, 1]
    assert steps_of("", "ja") == []
    assert steps_of("三文字", "ja")[0][0] == steps_of("三人", "ja")[0][0]


def test_french_has_no_models() -> None:
    assert load_network("distress", "fr") is None
    assert asked_for("Tu peux lever les bras ?", "fr")[1] == 1


def test_two_models_agree_where_both_are_sure() -> None:
    sure, open_, against = np.array([0.9, 0.1]), np.array([0.5, 0.5]), np.array([0.1, 0.9])
    assert agreed(sure, sure) == pytest.approx(sure)
    assert agreed(sure, open_) == pytest.approx([0.75, 0.25])
    assert agreed(sure, against) == pytest.approx([0.5, 0.5])


def test_words_are_known_by_their_meaning() -> None:
    """No line that the network was trained on speaks of a forearm."""
    network = NETWORK["en"]
    assert network is not None
    forearm, nonsense = (network(f"i think i broke my {what}") for what in ("forearm", "blurg"))
    assert 1 - forearm[-1] > 0.95 > 1 - nonsense[-1]
