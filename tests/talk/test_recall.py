"""The partner keeps what it was told, corrects it, and repeats it when asked."""

from datetime import timedelta

import pytest
from tests.fixtures.talk import Talk


@pytest.mark.parametrize(
    ("first", "then", "asks", "knows"),
    [
        ("My wife was a nurse.", "Remember that her name was Maureen.",
         "What was my wife's name?", "Maureen"),
        ("My grandson came to see me on Sunday.", "Please remember that he plays the trumpet.",
         "What does my grandson play?", "trumpet"),
        ("My late husband built ships.", "Remember that he was called Tom.",
         "What was my husband called?", "Tom"),
    ],
)  # fmt: skip
def test_it_knows_whom_she_or_he_was(
    talk: Talk, first: str, then: str, asks: str, knows: str
) -> None:
    for said in (first, then, "It is cold today."):
        talk.say(said)
    assert knows in (talk.say(asks).answer or "")
    assert knows not in (talk.say("What was my uncle's name?").answer or "")


@pytest.mark.parametrize(
    ("first", "then"),
    [
        ("My brother was a nurse.", "Remember that her name was Maureen."),
        ("My sister and my wife were nurses.", "Remember that her name was Maureen."),
        ("My sister came.", "Remember that Maureen has her keys."),
        ("My sister came.", "Remember that her name is Maureen. My wife is Ann."),
    ],
)
def test_whom_she_may_be_is_not_guessed(talk: Talk, first: str, then: str) -> None:
    for said in ("My name is Dot.", first, then):
        talk.say(said)
    assert not any(told.startswith(("my wife: ", "my brother: ")) for told in facts(talk))


def test_what_one_person_said_or_long_ago_names_nobody(talk: Talk) -> None:
    talk.say("My name is Dot.")
    talk.say("My wife was a nurse.")
    talk.say("My name is Tom.")
    talk.say("Remember that her birthday is on Friday.")
    talk.say("My daughter lives in Leeds.")
    talk.now += timedelta(minutes=6)
    talk.say("Remember that she has a cat.")
    assert {"her birthday is on Friday", "she has a cat"} <= set(facts(talk))


def facts(talk: Talk) -> list[str]:
    present = talk.speech.memory.present
    return [] if present is None else [fact.text for fact in present.facts]


def test_what_somebody_asked_it_to_keep_is_said_back_before_what_was_told(talk: Talk) -> None:
    asks = "Wasn't there something you were meant to remind me about?"
    assert "nothing" in talk.say(asks).answer
    talk.say("Remind me about the bins tonight, will you?")
    talk.say("My daughter Anna lives in Leeds.")
    assert "the bins tonight" in talk.say("Say it back to me.").answer
    kept = talk.say(asks).answer
    assert "the bins tonight" in kept
    assert "Leeds" not in kept


def test_it_takes_a_correction_and_repeats_what_it_said_not_that_it_said_it(talk: Talk) -> None:
    talk.say("I've got the hospital on Thursday, so remember that for me please.")
    assert talk.say("No, hang on, it's Friday, not Thursday.").meant == "amend"
    when = talk.say("So when's my appointment?").answer
    assert "Thursday" in when
    assert "Friday" in when
    first = talk.say("Say that again.").answer
    assert talk.say("Say that again.").answer.endswith(first.split(": ", 1)[1])


def test_what_it_keeps_is_written_as_it_was_said(talk: Talk) -> None:
    kept = talk.say("Remind me to take the soup to Marjorie, she's got a cold.").answer
    assert "take the soup to Marjorie, she's got a cold" in kept


def test_what_it_was_not_told_is_not_answered_with_something_else(talk: Talk) -> None:
    talk.say("I've got the dentist on Thursday at ten, so remember that for me.")
    assert "dentist" not in talk.say("What was I going to do with the sheets?").answer


def test_what_follows_a_wish_to_remember_is_kept(talk: Talk) -> None:
    kept = talk.say("Remember something for me, would you? The hint is purple otter.").answer
    assert "The hint is purple otter" in kept
    assert "purple otter" in talk.say("What was that hint I gave you?").answer


def test_a_correction_of_what_was_only_said_is_told_with_it(talk: Talk) -> None:
    talk.say("And I've got to ring the garage about the van, it's the MOT on the third.")
    talk.say("No, not the third, the thirteenth. Third's the dentist.")
    assert "the thirteenth" in talk.say("So when's the MOT?").answer


def test_a_name_that_follows_a_fact_is_told_with_it(talk: Talk) -> None:
    talk.say("My grandson would have filmed that. Oliver, he's nineteen, he's at Leeds.")
    assert "Oliver" in talk.say("What was my grandson called, do you remember?").answer


@pytest.mark.parametrize(
    "asked", ["What train is Maureen on?", "You told me about Maureen. Which train is she on?"]
)
def test_a_question_about_somebody_who_was_named_is_answered(talk: Talk, asked: str) -> None:
    talk.say("My sister Maureen is coming on Friday, she's getting the ten forty train.")
    assert "ten forty" in talk.say(asked).answer


def test_a_correction_of_a_name_does_not_rename_the_person_present(talk: Talk) -> None:
    talk.say("She lives in Vancouver with her boyfriend, Tom.")
    talk.say("No, not Tom, what am I saying, Tom was the last one. It's Luke.")
    assert talk.speech.memory.present is None


def test_a_name_that_is_to_be_remembered_is_only_a_name(talk: Talk) -> None:
    talk.say("My name's Maureen, but everybody calls me Mo. Will you remember that?")
    present = talk.speech.memory.present
    assert present is not None
    assert present.name == "Mo"


@pytest.mark.parametrize(
    ("said", "asked", "holds"),
    [
        (["I've a geranium out there on its last legs.", "He's called Gerald."],
         "What's the name of my geranium?", "Gerald"),
        (["His nan's coming on Saturday.", "She's called Nana Pat.", "She has a dog, too."],
         "What is his nan called?", "Nana Pat"),
        (["Can you remember something for me, his library book's due back on Thursday."],
         "When did I say that library book was due?", "Thursday"),
        (["I've put the spare key in the blue teapot, and I want you to remember that because I "
          "shan't."], "Where'd I tell you my spare key was?", "blue teapot"),
    ],
)  # fmt: skip
def test_what_was_told_in_two_remarks_or_on_the_way_is_recalled(
    talk: Talk, said: list[str], asked: str, holds: str
) -> None:
    for each in said:
        talk.say(each)
    answer = talk.say(asked)
    assert (answer.meant, holds in (answer.answer or "")) == ("recall", True), answer.answer


@pytest.mark.parametrize(
    ("asked", "answer"),
    [("So how long is it till our Janet comes?", "days away"),
     ("How many sleeps till tomorrow?", "tomorrow"), ("How long is it till supper?", "")],
)  # fmt: skip
def test_it_counts_the_days_until_what_was_told(talk: Talk, asked: str, answer: str) -> None:
    talk.say("Our Janet's coming on Monday with the little one.")
    said = talk.say(asked)
    assert (said.meant == "days_left") == bool(answer)
    assert answer in (said.answer or "")


def test_it_is_somebodys_turn_does_not_turn_it(talk: Talk) -> None:
    kept = talk.say("Can you remember it's Callum's turn to do the bins on Wednesday?")
    assert kept.meant == "remember"
    assert "bins" in (talk.say("What was I meant to remember about the bins?").answer or "")


@pytest.mark.parametrize(
    ("announced", "said", "asked", "holds"),
    [
        ("Can you remember a secret word if I tell you it?", "It's custard. Don't say it yet.",
         "What's the secret word?", "custard"),
        ("Could you remember something for me?", "The spare key's with Sandra.",
         "Who has the spare key?", "Sandra"),
        ("Tu peux retenir quelque chose pour moi ?", "La clé est chez Sandra.", "", "Sandra"),
        ("覚えておいてほしいことがあるの。", "鍵はサンドラさんに預けました。", "", "サンドラ"),
    ],
)  # fmt: skip
def test_what_follows_its_question_what_to_remember_is_kept(
    talk: Talk, announced: str, said: str, asked: str, holds: str
) -> None:
    assert talk.say(announced).meant == "remember_what"
    kept = talk.say(said)
    assert (kept.meant, holds in (kept.answer or "")) == ("remember_told", True)
    assert not asked or holds in (talk.say(asked).answer or "")


def test_a_question_in_between_is_not_what_to_remember(talk: Talk) -> None:
    talk.say("Could you remember something for me?")
    assert talk.say("What time is it?").meant == "time"
    assert talk.say("My sister is coming.").meant is None


@pytest.mark.parametrize(
    ("said", "asked", "holds"),
    [
        ("I taught geography for thirty-eight years.", "What subject did I teach?", "geography"),
        ("I'm off to the market with my sister Jean on Saturday.",
         "Who am I going to the market with?", "Jean"),
        ("I'm off to the market with my sister Jean on Saturday.",
         "Where am I going on Saturday?", "market"),
    ],
)  # fmt: skip
def test_a_question_in_other_words_finds_what_was_told(
    talk: Talk, said: str, asked: str, holds: str
) -> None:
    talk.say(said)
    assert holds in (talk.say(asked).answer or "")


@pytest.mark.parametrize(
    ("said", "asked", "holds"),
    [
        ("Will you remember something for me, the oat ones are running low and I've to tell Mo",
         "What was running low?", "oat ones"),
        ("Could you remember a thing for me, I've the eye clinic Thursday at twenty past ten",
         "And what time am I wanted at the eye clinic?", "twenty past ten"),
    ],
)  # fmt: skip
def test_what_is_announced_is_kept_rather_than_the_remark_before(
    talk: Talk, said: str, asked: str, holds: str
) -> None:
    talk.say("I had porridge this morning.")
    kept = talk.say(said)
    assert (kept.meant, holds in (kept.answer or "")) == ("remember_next", True)
    assert holds in (talk.say(asked).answer or "")
