"""Requests and orders that are no questions get an answer of their own, whatever they ask for."""

import pytest
from tests.fixtures.answers import answer

from miburi.talk.answers import Answerer


@pytest.mark.parametrize(
    ("said", "intent"),
    [
        ("What can you do, besides sit there and look at me?", "what_can_you"),
        ("Do you know where you are?", "own_place"),
        ("Only joking, don't be sad.", "apology"),
        ("Don't lean on the sideboard, will you.", "careful"),
        ("Don't wave at the neighbours.", "forbear"),
        ("stop humming its getting on my nerves", "forbear"),
        ("Never mention the party in front of Jean.", "secret"),
        ("Pinky promise you won't say anything to Dad.", "secret"),
        ("Mind the milk jug.", "careful"),
        ("Mind the vase on your left.", "careful"),
        ("careful theres a hot pan behind you", "careful"),
        ("Go easy on the puns tonight.", "careful"),
        ("Stay right there while I find my camera.", "stay_put"),
        ("Don't leave me.", "stay_put"),
        ("Forget I said anything.", "forget_it"),
        ("Be honest now.", "try_it"),
        ("let me finish", "try_it"),
        ("Close your eyes.", "cannot_do"),
        ("spell elephant for me", "cannot_do"),
        ("Hoover the stairs.", "cannot_do"),
        ("Listen to this.", "attend"),
        ("Write this down, eggs and a bag of flour.", "remember"),
        ("Zip it, you.", "quiet"),
        ("Wake me up before the news.", "watch_for"),
        ("Give me a high five, pal.", "high_five"),
        ("Stop twisting round, you're making me dizzy.", "stop"),
        ("Pull a funny face.", "show_disgust"),
        ("Ask me something.", "ask_me"),
        ("Why did they give you no legs?", "no_legs"),
        ("Are those paddles meant to be hands?", "hands"),
        ("Would you know if something was wrong with you?", "self_check"),
        ("Do people argue in front of you?", "seen_life"),
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
        "Don't see him much these days.",
        "Put the bins out this morning in the rain.",
        "Don't mention it.",
        "Watched the tennis till late.",
        "Stop fretting, I told him.",
        "Don't leave me alone with him.",
        "Don't let him in.",
        "Don't hit me.",
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
