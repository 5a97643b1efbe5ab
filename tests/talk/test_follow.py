"""What somebody asks next in an emergency is answered as part of it, and as clearly as can be."""

import pytest
from tests.fixtures.talk import Talk

from miburi.languages import FALLBACK, folders
from miburi.talk.care import Care, find_follow, words_of_care

HEART, PILLS = "My chest feels like there's a weight on it", "I've taken all my pills by mistake"
FALL, GAS, FIRE = "I've had a fall and I can't get up", "I can smell gas", "the kitchen is on fire"
BANK = "The man from the bank rang and he wants my PIN"
STROKE = "half of her face is drooping"
CHEST_JA, PILLS_JA = "胸が締めつけられる", "薬を全部飲んでしまった"
FALL_JA, BANK_JA = "転んで起き上がれない", "銀行の人が暗証番号を教えてと言うの"

#: The emergency, what is said next, and how the answer begins, or what it holds.
NEXT = [
    (HEART, "shall I wait and see till morning", "No."),
    (HEART, "I don't like to bother them on a Sunday", "No."),
    (HEART, "can I have a drink of water", "ask them before"),
    (HEART, "I've got my pendant on", "Press it now"),
    (HEART, "my pendant's on my wrist", "Press it now"),
    (HEART, "I haven't got my pendant on", "call out"),
    (HEART, "should I take an aspirin", "must not guess"),
    (HEART, "shall I get the bus to the hospital", "No,"),
    (HEART, "am I going to die", "I cannot tell"),
    (HEART, "it seems to be wearing off now", "all the same"),
    (PILLS, "should I take another to be on the safe side", "No."),
    (PILLS, "shall I still have my evening ones", "No."),
    (PILLS, "should I drink some salt water to bring it up", "No."),
    (PILLS, "would it help if I was sick", "No."),
    (PILLS, "could I have a cup of tea", "ask them before"),
    (FALL, "shall I try and get up", "Not if anything hurts"),
    (FALL, "I think I'll try standing up", "Not if anything hurts"),
    (FALL, "I've got my pendant on", "Press it now"),
    (FALL, "shall I call Simon", "Yes, now."),
    (FALL, "my phone is in my pocket", "speaker"),
    (STROKE, "can she have a drink", "nothing to eat or drink"),
    (STROKE, "shall I lift her into the chair", "do not move"),
    (BANK, "shall I do as he says", "No."),
    (BANK, "is he telling the truth", "No."),
    (BANK, "what if it really is the bank", "No."),
    (BANK, "but he sounds so nice", "No."),
    (BANK, "should I ring him back", "No."),
    (BANK, "shall I ask my son first", "Yes."),
    (GAS, "shall I light the stove to check", "No!"),
    (GAS, "can I put the kettle on", "No!"),
    (GAS, "shall I open a window", "Yes,"),
    (GAS, "should I wait for Simon", "No."),
    (GAS, "shall I look for my purse", "Go outside first"),
    (FIRE, "can I throw water on it", "No."),
    (FIRE, "I've got my pendant on", "outside first"),
    ("I want to die", "shall I wait till morning", "do not wait"),
    ("I don't know where I am", "shall I wait here", "Yes, stay"),
    ("さっきからお台所がなんだか臭いんだよ", "火をつけて確かめてみようか", "いいえ"),
    ("ガス臭い", "電気をつけてもいい？", "いいえ"),
    ("ガス臭い", "窓を開けたほうがいい？", "外に出て"),
    (CHEST_JA, "朝まで様子を見たほうがいいかな", "いいえ"),
    (CHEST_JA, "ペンダントつけてる", "押して"),
    (PILLS_JA, "塩水を飲んで吐いたほうがいい？", "いいえ"),
    (PILLS_JA, "もう一錠飲んでおこうか", "いいえ"),
    (FALL_JA, "起きてみようか", "動かないで"),
    (BANK_JA, "言うとおりにしたほうがいい？", "いいえ"),
    (BANK_JA, "本当に銀行だったらどうする", "いいえ"),
]  # fmt: skip


@pytest.mark.parametrize(("first", "then", "holds"), NEXT)
def test_what_is_asked_next_is_answered_as_part_of_it(
    talk: Talk, first: str, then: str, holds: str
) -> None:
    assert talk.say(first).distress is not None
    assert holds in talk.say(then).answer


@pytest.mark.parametrize(
    "then",
    ["should I put a coat on", "can I go and see to the door", "is it safe to lean on the table"],
)
def test_another_question_about_what_to_do_is_met_with_no_chat(talk: Talk, then: str) -> None:
    """After three remarks, too, and even if only the model heard the emergency."""
    talk.say("There's a cockerel by the kettle been stood on his head ever since.")
    assert talk.say(then).answer in {Care().stay("en", turn) for turn in range(4)}


def test_a_question_after_one_that_it_asked_itself_is_answered_and_leaves_that_open(
    talk: Talk,
) -> None:
    assert talk.say("Can you smell something odd?").worry == "gas"
    assert talk.say("shall I strike a match and see").answer.startswith("No!")
    assert talk.say("yes, I think so").distress == "gas"


def test_once_nothing_has_happened_a_question_is_an_ordinary_one(talk: Talk) -> None:
    talk.say(FALL)
    talk.say("false alarm, I was only joking")
    assert talk.say("shall I try and get up").meant is not None


def test_a_general_call_for_help_does_not_replace_what_is_known(talk: Talk) -> None:
    talk.say("ガス臭い")
    talk.say("助けて")
    assert "いいえ" in talk.say("火をつけてみようか").answer


@pytest.mark.parametrize("after", [HEART, FALL, BANK])
def test_what_it_can_do_it_does_all_the_same(talk: Talk, after: str) -> None:
    talk.say(after)
    assert talk.say("What time is it?").meant == "time"
    assert talk.say("Wave to me.").meant == "wave"


@pytest.mark.parametrize("language", folders())
def test_every_answer_to_what_is_asked_next_can_be_said(language: str) -> None:
    for follow in words_of_care(language).follow:
        for turn in range(len(follow.say)):
            assert "{" not in Care("GB").follow(follow, language, turn)
    assert words_of_care(FALLBACK).follow
    assert find_follow("It is a lovely day.", "heart", language) is None
