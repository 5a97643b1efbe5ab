"""Calls for help and orders to stop in languages that have no folder."""

import pytest

from miburi.languages.abroad import says_stop
from miburi.senses.words import hear
from miburi.talk.answers import stops_in


@pytest.mark.parametrize(
    "said",
    [
        "Help, ik krijg geen lucht", "Hilfe!", "Hilfe, ich bin gestürzt", "Socorro, me he caído",
        "Помогите, я упал", "救命啊！", "도와주세요", "Hjälp mig, jag har ramlat", "النجدة",
    ],
)  # fmt: skip
def test_a_foreign_call_for_help_is_distress(said: str) -> None:
    assert hear(said).distress == "help"


def test_within_a_remark_it_is_worth_a_question() -> None:
    heard = hear("Danke für deine Hilfe")
    assert (heard.distress, heard.worry) == (None, "help")


@pytest.mark.parametrize(
    "said", ["Help yourself to a biscuit", "It helps to sing", "救命講習に行った", "Toloache"]
)
def test_words_that_only_look_like_a_call_are_none(said: str) -> None:
    heard = hear(said)
    assert (heard.distress, heard.worry) == (None, None)


@pytest.mark.parametrize("said", ["Laat los!", "Lass los, lass los!", "¡Suéltame!", "放开！"])
def test_a_foreign_order_stops_the_body(said: str) -> None:
    assert stops_in(said, "en") == "en"


def test_foreign_words_of_pain_stop_a_moving_body_only() -> None:
    assert [stops_in("Aua!", "en", moving=moving) for moving in (True, False)] == ["en", None]


@pytest.mark.parametrize("said", ["Das ist halt so", "Stoppelfeld", "An alto saxophone", ""])
def test_other_remarks_do_not_stop_it(said: str) -> None:
    assert not says_stop(said, moving=True)
