"""The partner keeps what it was told, corrects it, and repeats it when asked."""

from datetime import timedelta

import pytest
from tests.fixtures.talk import Talk

#: Remarks, in order; a question after them; and a part of its answer.
TOLD = [
    (["My wife was a nurse.", "Remember that her name was Maureen.", "It is cold today."],
     "What was my wife's name?", "Maureen"),
    (["My late husband built ships.", "Remember that he was called Tom.", "It is cold today."],
     "What was my husband called?", "Tom"),
    (["Remember something for me, would you? The hint is purple otter."],
     "What was that hint I gave you?", "purple otter"),
    (["Remind me to take the soup to Marjorie, she's got a cold."],
     "What was I to take to Marjorie?", "take the soup to Marjorie, she's got a cold"),
    (["My grandson would have filmed that. Oliver, he's nineteen, he's at Leeds."],
     "What was my grandson called, do you remember?", "Oliver"),
    (["My sister Maureen is coming on Friday, she's getting the ten forty train."],
     "You told me about Maureen. Which train is she on?", "ten forty"),
    (["I've a geranium out there on its last legs.", "He's called Gerald."],
     "What's the name of my geranium?", "Gerald"),
    (["His nan's coming on Saturday.", "She's called Nana Pat.", "She has a dog, too."],
     "What is his nan called?", "Nana Pat"),
    (["Can you remember something for me, his library book's due back on Thursday."],
     "When did I say that library book was due?", "Thursday"),
    (["I taught geography for thirty-eight years."], "What subject did I teach?", "geography"),
    (["I'm off to the market with my sister Jean on Saturday."],
     "Where am I going on Saturday?", "market"),
    (["My wife would have had you dusted by now.", "Maureen, that was her name."],
     "And my wife, do you remember what she was called?", "Maureen"),
    (["My grandpa sat in that chair till last winter.", "What day is it?",
      "Grandma says that is fine.", "His name was Walt and he could whistle."],
     "Hey, what was my grandpa's name?", "Walt"),
    (["It was Clare's idea, that's the daughter, she's over in Ludlow."],
     "I'll test you now, what did I say my daughter's name was?", "Clare"),
    (["It was Clare's idea, that's the daughter, she's over in Ludlow.", "It rained.",
      "What is my daughter called?"], "And where is she living?", "Ludlow"),
    (["Biddy is the cat, she's fourteen, and she hates everybody."],
     "How old is the cat?", "fourteen"),
    (["I play on the left wing for our school team, number eleven.", "It rained."],
     "right memory test, what number do I wear?", "eleven"),
    (["It's two sugars for him and none for her."],
     "Who has the sugars, then, did you catch that?", "two sugars"),
    (["I'd like to go to Whitby on the train.", "Ruth wants me to do pottery."],
     "Where was it I said I wanted to go?", "Whitby"),
    (["my son is Simon", "Simon comes on Thursdays", "It's Friday he comes, not Thursday"],
     "when does my son come", "Friday"),
    (["Mavis brought scones", "no, I tell a lie, it was Doreen"], "who came round", "Doreen"),
    (["My husband was a baker.", "I tell a lie, he was a miller."], "What was my husband?",
     "miller"),
    (["木曜日はな、十時から手芸教室があるねん。", "今日は寒いなあ"],
     "手芸教室は何曜日やった", "木曜日"),
    (["眼鏡は戸棚の引き出しにしまった", "昼は蕎麦にしよう"],
     "眼鏡どこにしまったか覚えとる？", "引き出し"),
]  # fmt: skip


@pytest.mark.parametrize(("said", "asked", "holds"), TOLD)
def test_a_fact_is_recalled(talk: Talk, said: list[str], asked: str, holds: str) -> None:
    for each in said:
        talk.say(each)
    answer = talk.say(asked)
    assert (answer.meant, holds in answer.answer) == ("recall", True), answer.answer
    assert holds not in talk.say("What was my uncle's name?").answer


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


@pytest.mark.parametrize(
    "asks", ["what did I ask you to remember", "What have I asked you to remember?"]
)
def test_it_says_what_it_was_asked_to_remember(talk: Talk, asks: str) -> None:
    assert talk.say(asks).meant == "reminders"
    talk.say("Remember that Simon comes on Thursdays.")
    assert "Thursdays" in talk.say(asks).answer


def test_it_takes_a_correction_and_repeats_what_it_said_not_that_it_said_it(talk: Talk) -> None:
    talk.say("I've got the hospital on Thursday, so remember that for me please.")
    assert talk.say("No, hang on, it's Friday, not Thursday.").meant == "amend"
    when = talk.say("So when's my appointment?").answer
    assert "Thursday" in when
    assert "Friday" in when
    first = talk.say("Say that again.").answer
    assert talk.say("Say that again.").answer.endswith(first.split(": ", 1)[1])


@pytest.mark.parametrize(
    ("announced", "said", "asked", "holds"),
    [
        ("Can you remember a secret word if I tell you it?", "It's custard. Don't say it yet.",
         "What's the secret word?", "custard"),
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


def test_an_announced_fact_is_kept_rather_than_the_remark_before(talk: Talk) -> None:
    talk.say("I had porridge this morning.")
    said = "Will you remember something for me, the oat ones are running low and I've to tell Mo"
    kept = talk.say(said)
    assert (kept.meant, "oat ones" in kept.answer) == ("remember_next", True)
    assert "oat ones" in talk.say("What was running low?").answer
