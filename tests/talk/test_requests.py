"""Requests and orders that are no questions get an answer of their own, whatever they ask for."""

import pytest
from tests.fixtures.answers import answer, meant
from tests.fixtures.talk import Talk

from miburi.languages import language_of
from miburi.talk.answers import Answerer
from miburi.talk.script import script


@pytest.mark.parametrize(
    "said",
    [
        "do you tell anyone what I say",
        "are you going to tell Simon what I say",
        "who hears what I tell you",
        "Does anybody else hear what I say?",
        "Will you tell my daughter about this?",
        "Is this private?",
        "話したことをだれかに言う？",
        "息子に私の言ったことを話すの？",
    ],
)
def test_who_hears_somebody_is_answered_truly(said: str) -> None:
    language = language_of(said)
    for seed in range(6):
        text = answer(said, language, Answerer(seed)).text
        assert ("sharing" if language == "en" else "共有") in text


@pytest.mark.parametrize("language", ["en", "ja"])
def test_it_promises_no_secrecy(language: str) -> None:
    said = [line for cue in script(language).intent for line in cue.say]
    assert not [line for line in said if "tell nobody." in line or "だれにも言いません" in line]


@pytest.mark.parametrize(
    ("said", "intent"),
    [
        ("What can you do, besides sit there and look at me?", "what_can_you"),
        ("Do you know where you are?", "own_place"),
        ("Only joking, don't be sad.", "apology"),
        ("Don't lean on the sideboard, will you.", "careful"),
        ("Don't wave at the neighbours.", "forbear"),
        ("Pinky promise you won't say anything to Dad.", "secret"),
        ("careful theres a hot pan behind you", "careful"),
        ("Close your eyes.", "cannot_do"),
        ("Listen to this.", "attend"),
        ("Write this down, eggs and a bag of flour.", "remember"),
        ("Zip it, you.", "quiet"),
        ("Wake me up before the news.", "watch_for"),
        ("Stop twisting round, you're making me dizzy.", "stop"),
        ("Ask me something.", "ask_me"),
        ("Why did they give you no legs?", "no_legs"),
        ("Would you know if something was wrong with you?", "self_check"),
        ("wait is your face literally just a phone?", "phone_face"),
        ("can you look up and hold still a sec?", "look_up"),
        ("You're not bad company, you know, for a telephone.", "praise"),
        ("what do you do when you don't know something?", "unknowing"),
        ("Hang on, that's the buzzer, don't go anywhere.", "stay_put"),
        ("Sorry about that, I'm back, that was the postman.", "greeting_back"),
        ("Would you mind speaking a little slower?", "pace"),
        ("Could you tell Jean I said hello?", "message"),
        ("You scared of birds?", "had_feeling"),
        ("Is it all right if I talk about her a little?", "permission"),
        ("Do you think that's sad?", "opinion"),
        ("Will you still know who I am in the morning?", "forgets"),
        ("Lift up your two arms there.", "lift_arms"),
        ("Lift your left one up slow for me, I want to listen to it.", "lift_left"),
        ("A nice big smile for Grandma, please.", "show_happiness"),
        ("Twist yourself all the way over to the one side.", "turn"),
        ("Whisht now a minute till I hear the race.", "quiet"),
        ("Are you awake there at all?", "awake"),
        ("Cross your fingers for me.", "luck"),
        ("let me try something please remember the number 4172 for me", "remember"),
        ("i'd best get my stockings off then so turn your head the other way", "turn"),
        ("You like dogs?", "likes"),
        ("So tell me now, what you can do?", "what_can_you"),
        ("Theo wants to know if you eat crackers.", "eat"),
    ],
)
def test_a_request_is_heard_as_one(said: str, intent: str) -> None:
    cue = answer(said).cue
    assert cue is not None
    assert cue.name == intent


@pytest.mark.parametrize(
    "said",
    [
        "Mind you, he was never one for dancing.",
        "Put the bins out this morning in the rain.",
        "Don't mention it.",
        "Stop fretting, I told him.",
        "Don't leave me alone with him.",
        "Ooh, my knee's giving me some gyp today, it's the left one.",
        "I'm drawing you while we talk, your head's well hard to get right.",
        "Oh my days, mum's gonna shout me for dinner any minute.",
        "You remind me of a bird, a very strange bird.",
        "alright safe, I'll try remember that",
        "My neighbour waved at me this morning.",
        "I used to lift both arms above my head.",
        "I told him what you can do.",
    ],
)
def test_a_telling_that_begins_like_a_request_is_none(said: str) -> None:
    cue = answer(said).cue
    assert cue is None or cue.name in {"thanks", "agreement"}


def test_whoever_wants_a_secret_kept_is_told_to_tell_a_person() -> None:
    one = Answerer()
    for _ in range(4):
        said = answer("Never tell anyone what he did to me.", answerer=one).text
        assert "tell" in said
        assert "person" in said or "somebody" in said


def test_what_is_praised_is_named_as_the_partner_says_it() -> None:
    assert "your kitchen" in answer("Say something nice about my kitchen.").text


@pytest.mark.parametrize(
    "said",
    [
        "Say, my knee's been acting up since Tuesday, the left one, all that braking I did.",
        "Mine do. I've got a bad hip and all, the left one, they're going to do it in February.",
    ],
)
def test_which_knee_it_is_orders_nothing(said: str) -> None:
    assert meant(said) != "lift_left"


def test_a_feeling_that_somebody_has_is_no_order_to_show_it(talk: Talk) -> None:
    """A stranger wrote "I am sad", and got "Sad, like this." for it."""
    heard = talk.say("I am sad")
    assert (heard.meant, heard.felt != []) == (None, True)
