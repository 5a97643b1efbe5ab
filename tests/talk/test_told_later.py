"""Recall of what was told several remarks ago, follow-up questions, times and sums."""

import pytest
from tests.fixtures.answers import answer
from tests.fixtures.talk import Talk


def tell(talk: Talk, *said: str) -> None:
    for each in said:
        talk.say(each)


@pytest.mark.parametrize(
    ("said", "asked", "holds"),
    [
        (["My wife would have had you dusted by now.", "Maureen, that was her name."],
         "And my wife, do you remember what she was called?", "Maureen"),
        (["My grandpa sat in that chair till last winter.", "What day is it?",
          "Grandma says that is fine.", "His name was Walt and he could whistle."],
         "Hey, what was my grandpa's name?", "Walt"),
        (["It was Clare's idea, that's the daughter, she's over in Ludlow."],
         "I'll test you now, what did I say my daughter's name was?", "Clare"),
        (["Biddy is the cat, she's fourteen, and she hates everybody."],
         "How old is the cat?", "fourteen"),
        (["I got a 52 in maths and hid it in the dog's bed.", "The dog's name is Brisket."],
         "What's my dog's name?", "Brisket"),
        (["We met at a dance in Oban in 1966.", "Jean used to play Schubert badly."],
         "Where did I say Jean and I met?", "Oban"),
        (["She reckons I'm alone too much, but I've got the cat.",
          "Cat's called Pilchard, a big ginger tom."],
         "Here, what did I say my cat was called?", "Pilchard"),
        (["I play on the left wing for our school team, number eleven.", "It rained."],
         "right memory test, what number do I wear?", "eleven"),
        (["We made two hundred and forty dinners a day, none of them out of a packet."],
         "And how many dinners was it we did?", "two hundred and forty"),
        (["It's two sugars for him and none for her."],
         "Who has the sugars, then, did you catch that?", "two sugars"),
        (["I'd like to go to Whitby on the train.", "Ruth wants me to do pottery."],
         "Where was it I said I wanted to go?", "Whitby"),
    ],
)  # fmt: skip
def test_names_and_places_that_were_told_later_are_found(
    talk: Talk, said: list[str], asked: str, holds: str
) -> None:
    tell(talk, *said)
    answer = talk.say(asked)
    assert (answer.meant, holds in answer.answer) == ("recall", True), answer.answer


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


def test_she_is_whom_the_question_before_was_about(talk: Talk) -> None:
    tell(talk, "It was Clare's idea, that's the daughter, she's over in Ludlow.", "It rained.")
    tell(talk, "What is my daughter called?")
    assert "Ludlow" in talk.say("And where is she living?").answer


def test_an_order_is_nothing_that_was_told(talk: Talk) -> None:
    tell(talk, "Now the other arm, please.")
    assert "please" not in talk.say("Which arm is still up?").answer


@pytest.mark.parametrize(
    ("told", "asked", "left"),
    [
        ("My mum's picking me up at five.", "How long is that till my mum comes?", "5 hours away"),
        ("The nurse is to come at half two.", "How long more is that?", "2 hours and 30 minutes"),
        ("I have to catch the 74 bus at quarter past one.",
         "And how long have I got before that now?", "1 hour and 15 minutes"),
        ("Lunch is at 12:31.", "How long is it until lunch?", "31 minutes"),
        ("Lunch is at 1:01 pm.", "How long is it until lunch?", "1 hour and 1 minute away"),
        ("I've got a meeting at nine fifteen tomorrow.",
         "How long have I got until nine fifteen?", "tomorrow"),
        ("It rained.", "I fly home on the twentieth of December, how long is it still?", "25 days"),
        ("It rained.", "How long is it till December third?", "8 days"),
        ("It's my nephew's birthday on Saturday.", "How many days is that away?", "3 days"),
        ("It's a fine day.", "How long until ten to four?", "3 hours and 50 minutes"),
        ("It's a fine day.", "How long is it till midnight?", "12 hours away"),
        ("It's a fine day.", "How long till 3am?", "15 hours away"),
    ],
)  # fmt: skip
def test_it_counts_the_time_until_what_was_told(
    talk: Talk, told: str, asked: str, left: str
) -> None:
    tell(talk, told)
    assert left in talk.say(asked).answer  # it is noon


def test_it_counts_no_time_to_live_and_none_that_nobody_told(talk: Talk) -> None:
    tell(talk, "I go to bed at ten.")
    assert "away" not in talk.say("How long have I got to live?").answer
    assert "away" not in talk.say("How long until the kettle boils?").answer


@pytest.mark.parametrize(
    ("asked", "result"),
    [
        ("what's seven times eight?", "56"),
        ("What is seventeen times twenty-three?", "391"),
        ("And 7+8?", "15"),
        ("What is 12 divided by 5?", "2.4"),
        ("What is two hundred and sixteen minus ninety nine?", "117"),
    ],
)
def test_it_works_out_a_small_sum(talk: Talk, asked: str, result: str) -> None:
    answer = talk.say(asked)
    assert (answer.meant, result in answer.answer) == ("sum", True), answer.answer


@pytest.mark.parametrize("asked", ["What is 3 / 0?", "What is one tablet plus two tablets?"])
def test_it_gives_no_result_where_there_is_none(talk: Talk, asked: str) -> None:
    assert not any(letter.isdigit() for letter in talk.say(asked).answer)


def test_what_is_repeated_is_not_said_to_be_new(talk: Talk) -> None:
    talk.say("Dance for me.")
    again = talk.say("Do that again, but slower, so the cat doesn't bolt.")
    assert (again.meant, "only" in again.answer) == ("dance", True)
    assert talk.say("Go on then, show me.").meant == "dance"


@pytest.mark.parametrize(
    ("spoken", "meant"),
    [
        ("You like dogs?", "likes"),
        ("So tell me now, what you can do?", "what_can_you"),
        ("Theo wants to know if you eat crackers.", "eat"),
        ("Why you say that one?", "why_that"),
        ("I told him what you can do.", None),
    ],
)
def test_questions_that_are_spoken_without_a_verb(
    talk: Talk, spoken: str, meant: str | None
) -> None:
    assert talk.say(spoken).meant == meant


@pytest.mark.parametrize(
    ("said", "name"),
    [
        ("My name's Gordon, Gordon Tansley, and I'm seventy seven.", "Gordon"),
        ("Ok good, hi, I'm Priya.", "Priya"),
        ("Good. I'm Ingrid, and I've got twenty minutes.", "Ingrid"),
        ("My good name is Sudha, but they call me Aaji only.", "Sudha"),
        ("No, it's Canberra.", None),
        ("I'm Irish, and proud of it.", None),
        ("My mum calls me three times a day about what I should wear.", None),
    ],
)
def test_who_says_a_name_is_known_by_it(talk: Talk, said: str, name: str | None) -> None:
    talk.say(said)
    present = talk.speech.memory.present
    assert (present and present.name) == name


@pytest.mark.parametrize("asked", ["Who drove the bus, can you remember that?", "How old is he?"])
def test_a_question_is_not_kept_as_if_it_were_a_fact(talk: Talk, asked: str) -> None:
    talk.say("Brendan drove the number nine bus, and he is sixty.")
    talk.say(asked)
    assert talk.speech.memory.kept("en") is None


@pytest.mark.parametrize(
    ("said", "name"),
    [
        ("I'm Peg, Peg Twomey, and I'm eighty-six.", "Peg"),
        ("Nice, I'm Karthik, what do I call you?", "Karthik"),
        ("I'm Maureen, but everyone round here calls me Mo.", "Mo"),
        ("I'm Irish, and proud of it.", None),
    ],
)
def test_a_name_before_a_comma_is_one(said: str, name: str | None) -> None:
    told = answer(said)
    assert (told.words if told.do == "name" else None) == name


def test_a_question_is_not_what_it_is_to_remember(talk: Talk) -> None:
    tell(talk, "They want me there at six.", "What would it cost?")
    assert "six" in talk.say("Please remember that.").answer
    assert "blue" in talk.say("The door is blue. Would you try and keep that in mind?").answer


@pytest.mark.parametrize(
    ("told", "asked", "date"),
    [
        ("It's a week on Saturday.", "What date is that?", "Saturday, December 5"),
        ("They want me on Thursday.", "What date would a week from Thursday be?", "December 3"),
        ("The bank opens Monday week.", "What date is Monday week?", "December 7"),
        ("It rained.", "What date is it?", "November 25"),
    ],
)
def test_it_tells_the_date_of_a_day(talk: Talk, told: str, asked: str, date: str) -> None:
    tell(talk, told)
    assert date in talk.say(asked).answer


def test_it_keeps_a_list_and_reads_it_out(talk: Talk) -> None:
    tell(talk, "Let's make a list. Balloons, candles, paper plates. Can you keep that?")
    assert talk.say("Add party bags as well.").meant == "added"
    assert talk.say("Put cake on it please, a lemon one.").meant == "added"
    listed = talk.say("What have we got so far?").answer
    assert all(each in listed for each in ("candles", "party bags", "lemon"))


def test_after_a_dance_show_me_is_a_wish_for_it(talk: Talk) -> None:
    assert talk.say("Would you do a little dance at the party?").meant == "dance"
    assert talk.say("Show me now, so I know what I'm letting myself in for.").meant == "dance"
