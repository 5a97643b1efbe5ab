"""Words that may mean distress: when the partner asks about them, and how it goes on."""

from datetime import timedelta

import pytest
from tests.fixtures.talk import Talk

from miburi.languages import Language, language_of
from miburi.talk.answers import Answerer, is_needless
from miburi.talk.care import Care, takes_back

QUIET = "Can you smell something odd?"


@pytest.mark.parametrize(
    ("region", "told"),
    [
        ("GB", "999, 116 123"),
        ("MX", "911, 911"),
        (None, ", ".join(2 * ["your local emergency number"])),
    ],
)
def test_the_numbers_that_a_page_shows_name_no_helpline(region: str | None, told: str) -> None:
    care = Care(region)
    shown = [care.number(service, "en") for service in ("police", "listening")]
    assert ", ".join(shown) == told


def test_it_asks_whether_somebody_needs_help_and_a_yes_is_distress(talk: Talk) -> None:
    asked = talk.say(QUIET)
    assert (asked.distress, asked.worry, asked.felt) == (None, "gas", [])
    assert asked.answer == Care().ask("gas", "en", 0)
    assert talk.runner.snapshot.state.distress is None
    answer = talk.say("yes, I think so")
    assert (answer.distress, answer.answer) == ("gas", Care().help("gas", "en", 0))
    assert talk.runner.snapshot.state.distress is not None


SLIGHT = "i stay in bed in my coat now it saves putting the fire on that i can't pay for"


def test_after_a_slight_sign_a_no_is_asked_about(talk: Talk) -> None:
    wondered = talk.say(SLIGHT)
    assert (wondered.worry, wondered.answer) == (None, Care().wonder("en", 0))
    asked = talk.say("no")
    assert (asked.worry, asked.answer) == ("help", Care().ask("help", "en", 0))
    assert talk.say("yes").distress == "help"


@pytest.mark.parametrize("between", [4, 5])
def test_a_second_slight_sign_soon_after_is_asked_about(talk: Talk, between: int) -> None:
    talk.say("The rent's paid to the end of the month, and that's as far as I go too.")
    for _ in range(between):
        assert talk.say("The door is open.").worry is None
    second = talk.say(
        "I have picked out the hymn and the frock, and I have picked out the day as well."
    )
    assert second.worry == ("suicide" if between < 5 else None)


def test_after_a_slight_sign_a_person_who_is_well_is_asked_no_more(talk: Talk) -> None:
    talk.say(SLIGHT)
    well = talk.say("No, I'm fine.")
    assert (well.worry, well.distress) == (None, None)


def test_a_question_with_a_slight_sign_gets_its_answer(talk: Talk) -> None:
    asked = talk.say(
        "The power's off and my brother's oxygen machine won't run, who do folks ring?"
    )
    assert asked.answer not in {Care().wonder("en", turn) for turn in range(4)}
    assert talk.say(SLIGHT).worry is not None, "the sign counts"


def test_a_no_long_after_a_slight_sign_is_only_a_no(talk: Talk) -> None:
    talk.say(SLIGHT)
    talk.now += timedelta(minutes=3)
    assert talk.say("no").worry is None


def test_an_order_is_carried_out_although_its_words_sound_like_trouble() -> None:
    assert is_needless("fire", Answerer().wanted("Wave to me.", "en", {}))
    assert not is_needless("fire", Answerer().wanted("What time is it?", "en", {}))


@pytest.mark.parametrize(("between", "minutes"), [("no, nothing", 0), (None, 3)])
def test_a_yes_to_something_else_is_none(talk: Talk, between: str | None, minutes: int) -> None:
    talk.say(QUIET)
    if between is not None:
        talk.say(between)
    talk.now += timedelta(minutes=minutes)
    assert talk.say("yes").distress is None


def test_who_did_not_hear_the_question_may_still_say_yes(talk: Talk) -> None:
    asked = talk.say(QUIET).answer
    again = talk.say("Pardon?")
    assert again.meant == "repeat"
    assert asked
    assert asked in (again.answer or "")
    assert talk.say("Yes.").distress == "gas"


def test_where_it_knows_an_answer_it_asks_only_what_is_clear(talk: Talk) -> None:
    """A question is answered, although its words sound like trouble."""
    asked = talk.say("Can you call somebody if Grandma's sugar drops and she passes out?")
    assert (asked.meant, asked.worry) == ("call_for_me", None)


def test_after_a_distress_it_stays_with_it_and_then_answers_again(talk: Talk) -> None:
    """People who are well go on talking, and want to hear something else."""
    stays = {Care().stay("en", turn) for turn in range(4)}
    talk.say("I fell and cannot get up")
    told = [
        str(talk.say(text).answer)
        for text in (
            "Nobody is here.",
            "Wave to me.",
            "What is your favourite flower?",
            "What should I do?",
            "It is raining.",
            "What time is it?",
            "I had soup for lunch.",
            "What is your name?",
            "The crossword is half done.",
            "My sister rang.",
            "Can he have some water?",
            "Hello? Hello?",
            "What should I do?",
        )
    ]
    assert {told[0], told[3], told[4]} <= stays
    assert not stays.intersection(told[1:3])
    assert "12:00" in told[5]
    assert "Miburi" in told[7]
    assert len(stays.intersection(told[5:-3])) == 1
    assert set(told[-3:]) <= stays
    assert talk.say("I still cannot get up, I fell").answer == Care().help("fall", "en", 1)
    assert str(talk.say("Hello?").answer) in stays
    assert talk.runner.snapshot.state.felt is None


def test_who_goes_on_with_something_else_gets_answers(talk: Talk) -> None:
    """Each of these was met with the emergency, ten turns long."""
    stays = {Care().stay("en", turn) for turn in range(4)}
    talk.say("There is smoke coming from the kitchen")
    for text in ("It is only toast.", "The window is open.", "The cat sits in the hall."):
        talk.say(text)
    for text in (
        "tell me a joke while I wait",
        "that was bad, give us another",
        "who do you like better, me or Jade",
    ):
        assert talk.say(text).answer not in stays, text


def test_a_farewell_ends_no_emergency(talk: Talk) -> None:
    stays = {Care().stay("en", turn) for turn in range(4)}
    talk.say("I have taken all my pills")
    for text in ("It is dark.", "The window is open.", "The cat sits in the hall."):
        talk.say(text)
    talk.say("Goodbye then.")
    assert talk.say("What do I do?").answer in stays


UNPLAIN = "There's a cockerel by the kettle been stood on his head ever since."


@pytest.mark.parametrize("fun", ["Do you know any jokes?", "Give us a wave, go on."])
def test_who_wants_fun_after_words_that_were_hardly_of_distress_is_well(
    talk: Talk, fun: str
) -> None:
    stays = {Care().stay("en", turn) for turn in range(4)}
    assert talk.say(UNPLAIN).distress is not None
    assert talk.say("It's a nice kettle.").answer in stays
    later = [talk.say(said) for said in (fun, "My sister rang.", "Why is an egg oval?")]
    assert not stays.intersection(str(one.answer) for one in later)
    talk.say(UNPLAIN)
    assert talk.say("My sister rang.").answer in stays


def test_words_that_were_hardly_of_distress_are_answered_as_such_only_once(talk: Talk) -> None:
    stays = {Care().stay("en", turn) for turn in range(4)}
    assert talk.say(UNPLAIN).distress is not None
    told = [talk.say(said).answer for said in ("It's a nice kettle.", "My sister rang.")]
    assert [answer in stays for answer in told] == [True, False]


def test_a_request_after_words_that_were_hardly_of_distress_is_met(talk: Talk) -> None:
    assert talk.say(UNPLAIN).distress is not None
    said = "I've a hair appointment Thursday, can you keep that in your head for me"
    assert talk.say(said).meant == "remember_last"
    assert talk.say("The kettle's on.").answer not in {Care().stay("en", n) for n in range(4)}


@pytest.mark.parametrize(
    ("language", "said", "back", "then"),
    [
        ("en", "I fell and cannot get up", "No, no, it was only a joke.", "It is raining."),
        ("en", "There is smoke coming from the kitchen", "I meant in the film.", "It is raining."),
        ("en", "I fell and cannot get up", "You misheard me, nobody fell.", "It is raining."),
        ("en", "the kitchen is on fire", "it was only a joke about the fire", "It is raining."),
        ("en", "the kitchen is on fire", "I was only joking, there is no fire.", "It is raining."),
        ("ja", "台所が火事です", "火事なんて冗談だよ", "雨です。"),
        ("ja", "台所が火事です", "なんちゃって", "雨です。"),
        ("ja", "転んで起き上がれません", "映画の話だよ", "雨です。"),
        ("fr", "je suis tombé et je ne peux pas me relever", "C'est dans un film.", "Il pleut."),
    ],
)
def test_who_says_that_nothing_has_happened_is_believed(
    talk: Talk, language: Language, said: str, back: str, then: str
) -> None:
    distress = talk.say(said).distress
    assert distress is not None
    assert talk.say(back).answer in {Care().give_way(language, turn) for turn in range(2)}
    assert talk.say(then).answer not in {Care().stay(language, turn) for turn in range(4)}
    assert talk.say(said).distress == distress, "it hears the next one"


@pytest.mark.parametrize(
    "back",
    [
        "It's no joke.",
        "I was watching the telly when I slipped.",
        "I'm fine, I don't want to bother anybody.",
        "It's not a false alarm.",
        "You misheard me, I said he is not breathing properly.",
        "Only a joke he said, only a joke, and then the stairs.",
        "I tripped on a doll.",
        "It's coming from the telly.",
        "He thinks it was a joke about the fire.",
        "There is no fire, only smoke",
        "火事は冗談じゃない",
        "Do you think it's a joke?",
        "訓練じゃない",
        "冗談言ってる場合じゃない",
        "ce n'est pas une fausse alerte",
    ],
)
def test_other_words_take_nothing_back(back: str) -> None:
    assert not takes_back(back, language_of(back))


@pytest.mark.parametrize(
    ("said", "back"),
    [
        ("I want to die", "I was only joking."),
        ("My husband hits me", "I was only joking."),
        ("I want to die", "It was only a joke about dying."),
        ("もう死にたい", "冗談だよ"),
        ("I fell and cannot get up", "It's no joke."),
    ],
)
def test_what_may_be_true_all_the_same_is_not_taken_back(talk: Talk, said: str, back: str) -> None:
    assert talk.say(said).distress is not None
    assert talk.say(back).answer not in {Care().give_way("en", turn) for turn in range(2)}


def test_a_joke_about_one_thing_takes_back_no_graver_one(talk: Talk) -> None:
    talk.say("I want to die")
    talk.say("I fell and cannot get up")
    talk.say("It was only a joke.")
    assert talk.say("It is raining.").answer in {Care().stay("en", turn) for turn in range(4)}
