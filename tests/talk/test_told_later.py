"""Recall of what was told several remarks ago, follow-up questions, times and sums."""

import sys
import time
from datetime import datetime

import pytest
from tests.fixtures.answers import answer
from tests.fixtures.talk import NOON, Talk

from miburi.languages import language_of
from miburi.talk.dates import away, date_of, due_of
from miburi.talk.sums import sum_of


def tell(talk: Talk, *said: str) -> None:
    for each in said:
        talk.say(each)


def test_whom_he_means_is_not_guessed_from_long_ago(talk: Talk) -> None:
    tell(talk, "My husband grew leeks.", "It rained.", "It snowed.", "You sound like a blackbird.")
    tell(talk, "He had one white feather, so I called him Bishop.")
    assert "husband" not in talk.say("What did I call that blackbird?").answer


def test_no_name_from_long_ago_is_kept_with_a_fact(talk: Talk) -> None:
    tell(talk, "My name is Dot.", "My husband grew leeks.", "It rained.", "It snowed.")
    tell(talk, "Here is a blackbird.", "Please remember that he has one white feather.")
    assert talk.speech.memory.kept("en") == "he has one white feather"


def test_a_question_goes_on_about_what_was_recalled(talk: Talk) -> None:
    tell(talk, "I drove buses here for thirty-four years, Seacroft to Bramley mostly.")
    tell(talk, "The kettle is on.", "How many years did I say I drove for?")
    assert "Seacroft" in talk.say("And which route was it, can you tell me that?").answer
    tell(talk, "It's a fine day.")
    assert "Seacroft" not in talk.say("And which one was it?").answer


def test_an_order_is_nothing_that_was_told(talk: Talk) -> None:
    tell(talk, "Now the other arm, please.")
    assert "please" not in talk.say("Which arm is still up?").answer


def test_it_counts_no_time_to_live_and_none_that_nobody_told(talk: Talk) -> None:
    tell(talk, "I go to bed at ten.")
    assert "away" not in talk.say("How long have I got to live?").answer
    assert "away" not in talk.say("How long until the kettle boils?").answer


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no tzset")
@pytest.mark.parametrize(
    ("said", "due"),
    [
        ("The nurse comes tomorrow at 3 pm.", "2026-03-21T15:00:00+01:00"),
        ("The nurse comes tomorrow at 10:00.", "2026-03-21T10:00:00+01:00"),
        ("The nurse comes at nine on April 2nd.", "2026-04-02T09:00:00+02:00"),
        ("The nurse comes at half past two on April 2nd.", "2026-04-02T14:30:00+02:00"),
        ("The nurse comes on April 2nd for two nights.", "2026-04-02T09:00:00+02:00"),
        ("明日の午後3時に看護師さんが来る。", "2026-03-21T15:00:00+01:00"),
        ("4月2日の10時半に看護師さんが来る。", "2026-04-02T10:30:00+02:00"),
        ("4月2日に看護師さんが3時間いる。", "2026-04-02T09:00:00+02:00"),
        ("The nurse comes at nine.", None),
    ],
)
def test_a_fact_is_due_at_its_hour_and_with_the_offset_of_its_day(
    monkeypatch: pytest.MonkeyPatch, said: str, due: str | None
) -> None:
    """It was due at nine, and in summer with winter's offset."""
    with monkeypatch.context() as patch:
        patch.setenv("TZ", "CET-1CEST,M3.5.0,M10.5.0/3")
        time.tzset()
        now = datetime(2026, 3, 20, 10).astimezone()
        told = due_of(said, language_of(said), now)
        assert (told and told.isoformat()) == due
    time.tzset()


def test_it_counts_the_time_until_a_day_with_an_hour(talk: Talk) -> None:
    tell(talk, "My name is Dot.", "Remember that the nurse comes tomorrow at 3 pm.")
    assert "tomorrow" in talk.say("How long is it till the nurse comes?").answer


def test_what_is_repeated_is_not_said_to_be_new(talk: Talk) -> None:
    talk.say("Dance for me.")
    again = talk.say("Do that again, but slower, so the cat doesn't bolt.")
    assert (again.meant, "only" in again.answer) == ("dance", True)
    assert talk.say("Go on then, show me.").meant == "dance"


@pytest.mark.parametrize("asked", ["Who drove the bus, can you remember that?", "How old is he?"])
def test_a_question_is_not_kept_as_if_it_were_a_fact(talk: Talk, asked: str) -> None:
    talk.say("Brendan drove the number nine bus, and he is sixty.")
    talk.say(asked)
    assert talk.speech.memory.kept("en") is None


def test_a_question_is_not_the_fact_to_remember(talk: Talk) -> None:
    tell(talk, "They want me there at six.", "What would it cost?")
    assert "six" in talk.say("Please remember that.").answer
    assert "blue" in talk.say("The door is blue. Would you try and keep that in mind?").answer


def test_it_keeps_a_list_and_reads_it_out(talk: Talk) -> None:
    tell(talk, "Let's make a list. Balloons, candles, paper plates. Can you keep that?")
    assert talk.say("Add party bags as well.").meant == "added"
    assert talk.say("Put cake on it please, a lemon one.").meant == "added"
    listed = talk.say("What have we got so far?").answer
    assert all(each in listed for each in ("candles", "party bags", "lemon"))


def test_after_a_dance_show_me_is_a_wish_for_it(talk: Talk) -> None:
    assert talk.say("Would you do a little dance at the party?").meant == "dance"
    assert talk.say("Show me now, so I know what I'm letting myself in for.").meant == "dance"


@pytest.mark.parametrize(
    ("told", "asked", "left"),
    [
        ("The nurse is to come at half two.", "How long is that?", "2 hours and 30 minutes away"),
        ("The bus is at quarter past one.", "How long?", "1 hour and 15 minutes away"),
        ("Lunch is at 12:31.", "How long is it until lunch?", "31 minutes away"),
        ("Lunch is at 1:01 pm.", "How long is it until lunch?", "1 hour and 1 minute away"),
        ("I've a meeting at nine fifteen tomorrow.", "How long until nine fifteen?", "tomorrow"),
        (None, "I fly on the twentieth of December, how long is it still?", "25 days away"),
        (None, "How long is it till December third?", "8 days away"),
        ("It's my nephew's birthday on Saturday.", "How many days is that away?", "3 days away"),
        (None, "How long until ten to four?", "3 hours and 50 minutes away"),
        (None, "How long is it till midnight?", "12 hours away"),
        (None, "How long till 3am?", "15 hours away"),
        ("It's a fine day.", "How long until the kettle boils?", None),
    ],
)
def test_it_counts_the_time_until_an_event(told: str | None, asked: str, left: str | None) -> None:
    assert away(asked, told, "en", NOON) == left


@pytest.mark.parametrize(
    ("told", "asked", "date"),
    [
        ("It's a week on Saturday.", "What date is that?", "Saturday, December 5"),
        (None, "What date would a week from Thursday be?", "Thursday, December 3"),
        (None, "What's the date tomorrow?", "Thursday, November 26"),
        ("It rained.", "What date is it?", None),
    ],
)
def test_it_tells_the_date_of_a_day(told: str | None, asked: str, date: str | None) -> None:
    assert date_of(asked, told, "en", NOON) == date


@pytest.mark.parametrize(
    ("asked", "result"),
    [
        ("What is seventeen times twenty-three?", "391"),
        ("And 7+8?", "15"),
        ("What is 12 divided by 5?", "2.4"),
        ("What is two hundred and sixteen minus ninety nine?", "117"),
        ("What is 3 / 0?", None),
        ("What is one tablet plus two tablets?", None),
        ("100から37を引くといくつ", "63"),
        ("８×９は", "72"),
    ],
)
def test_it_works_out_a_sum(asked: str, result: str | None) -> None:
    assert sum_of(asked, language_of(asked)) == result


def test_it_says_a_sum_a_date_and_a_time(talk: Talk) -> None:
    tell(talk, "My mum's picking me up at five.")
    assert "5 hours away" in talk.say("How long is that till my mum comes?").answer
    assert "December 7" in talk.say("What date is Monday week?").answer
    answer = talk.say("what's seven times eight?")
    assert (answer.meant, "56" in answer.answer) == ("sum", True)
    assert not any(letter.isdigit() for letter in talk.say("What is 3 / 0?").answer)


@pytest.mark.parametrize(
    ("said", "name"),
    [
        ("My name's Gordon, Gordon Tansley, and I'm seventy seven.", "Gordon"),
        ("Good. I'm Ingrid, and I've got twenty minutes.", "Ingrid"),
        ("My good name is Sudha, but they call me Aaji only.", "Sudha"),
        ("I'm Maureen, but everyone round here calls me Mo.", "Mo"),
        ("No, it's Canberra.", None),
        ("I'm Irish, and proud of it.", None),
        ("My mum calls me three times a day about what I should wear.", None),
    ],
)
def test_a_speaker_is_known_by_the_name_they_give(said: str, name: str | None) -> None:
    told = answer(said)
    assert (told.words if told.do == "name" else None) == name
