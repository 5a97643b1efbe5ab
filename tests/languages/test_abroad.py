"""Calls for help and orders to stop in languages that have no folder."""

import pytest

from miburi.languages.abroad import says_stop, says_yes
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


@pytest.mark.parametrize(
    "said",
    [
        "hilfe hilfe", "HILFEEEE", "ΒΟΗΘΕΙΑ", "İmdat!", "hjalp mig", "救命救命", "Oddio, aiuto",
        "Schwester, Hilfe, ich kriege keine Luft", "Ich falle Hilfe", "Hulp, alsjeblieft!",
    ],
)  # fmt: skip
def test_accents_repetition_and_words_beside_it_do_not_hide_a_call(said: str) -> None:
    assert hear(said).distress == "help"


@pytest.mark.parametrize(
    "said",
    [
        "Aiutami a cercare gli occhiali", "Tolong, nyalakan lampu",
        "Hilfe? Nein, danke.",
    ],
)  # fmt: skip
def test_a_small_service_or_a_refusal_is_worth_a_question(said: str) -> None:
    heard = hear(said)
    assert (heard.distress, heard.worry) == (None, "help")


@pytest.mark.parametrize(
    "said",
    [
        "Help yourself to a biscuit", "It helps to sing", "救命講習に行った", "Pomocy nie trzeba",
        "Robot, help me: what's 7 times 8?", "Thanks, no help.", 'The tabs are File, Edit, "Help".',
        "Let's play charades. Help me, grandma!",
        "Socorro is a town in New Mexico", "「救命」という言葉", "Finger weg",
    ],
)  # fmt: skip
def test_words_that_only_look_like_a_call_are_none(said: str) -> None:
    heard = hear(said)
    assert (heard.distress, heard.worry) == (None, None)


@pytest.mark.parametrize(
    "said",
    [
        "Laat los!", "Lass los, lass los!", "¡Suéltame!", "放开！", "停停停", "birak beni",
        "Aua! Lass los!", "Au! Laat los!", "Miburi, lass los!", "Hilfe, lass mich los",
        "Nein! Lass mich los! Bitte!", "¡Suéltame! ¡Socorro!",
        "Stop, bitte",
    ],
)  # fmt: skip
def test_a_foreign_order_stops_the_body(said: str) -> None:
    assert stops_in(said, "ja") == "en"


@pytest.mark.parametrize("said", ["Lâchez-moi !", "Au secours, lâche-moi !", "Tu me fais mal"])
def test_french_orders_to_let_go_stop_it(said: str) -> None:
    assert stops_in(said, "fr", moving=True) == "fr"


@pytest.mark.parametrize("said", ["Nej tak", "不是", "Да нет", "Ya no", "Ja, das Wetter ist schön"])
def test_no_is_not_yes(said: str) -> None:
    assert not says_yes(said)


def test_a_long_text_of_ambiguous_words_is_read_at_once() -> None:
    assert not says_stop("para ya " * 100 + "hoy", moving=True)


def test_foreign_words_of_pain_stop_a_moving_body_only() -> None:
    assert [stops_in("Aua!", "en", moving=moving) for moving in (True, False)] == ["en", None]


@pytest.mark.parametrize("said", ["Das ist halt so", "Stoppelfeld", "An alto saxophone", ""])
def test_other_remarks_do_not_stop_it(said: str) -> None:
    assert not says_stop(said, moving=True)
